#include "daemon/common/number_table.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::daemon {
namespace {

TEST(NumberTable, KeepsAValueForEachNumber) {
  NumberTable<std::uint32_t> table;
  for (std::uint32_t number = 0; number <= 65535; number += 51) {
    table[static_cast<std::uint16_t>(number)] = number + 1;
  }
  for (std::uint32_t number = 0; number <= 65535; ++number) {
    const std::uint32_t* const found = table.find(static_cast<std::uint16_t>(number));
    ASSERT_NE(found, nullptr) << number;
    ASSERT_EQ(*found, number % 51 == 0 ? number + 1 : 0) << number;
  }
}

TEST(NumberTable, HasNothingWhereNothingWasPut) {
  NumberTable<int> table;
  table[300] = 7;
  EXPECT_EQ(table.find(0), nullptr);
  EXPECT_EQ(table.find(65535), nullptr);
  EXPECT_EQ(*table.find(301), 0);
}

TEST(NumberTable, ValuesStayWhereTheyAre) {
  NumberTable<int> table;
  int* const first = &table[1];
  for (std::uint32_t number = 0; number <= 65535; ++number)
    table[static_cast<std::uint16_t>(number)];
  EXPECT_EQ(&table[1], first);
}

}  // namespace
}  // namespace swarmtalk::daemon
