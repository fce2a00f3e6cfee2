#include "daemon/message/gateway_origin.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::daemon {
namespace {

TEST(GatewayOrigin, IsReadBackOffTheFrontOfTheMessage) {
  const GatewayOrigin origin{"kilobots", 0x1234, 0x5678, 0x9ABCDEF0};
  std::vector<std::uint8_t> bytes;
  append_origin(origin, bytes);
  EXPECT_EQ(bytes.size(), origin_bytes(origin));
  bytes.push_back('m');
  std::span<const std::uint8_t> rest(bytes);
  EXPECT_EQ(take_origin(rest), origin);
  ASSERT_EQ(rest.size(), 1u);
  EXPECT_EQ(rest[0], 'm');
}

TEST(GatewayOrigin, IsWrittenAsDocumented) {
  std::vector<std::uint8_t> bytes;
  append_origin({"ab", 0x0102, 0x0304, 0x05060708}, bytes);
  EXPECT_EQ(bytes, (std::vector<std::uint8_t>{2, 'a', 'b', 1, 2, 3, 4, 5, 6, 7, 8}));
}

TEST(GatewayOrigin, CutOrNamelessBytesAreMalformed) {
  std::vector<std::uint8_t> bytes;
  append_origin({"ab", 1, 2, 3}, bytes);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    std::span<const std::uint8_t> cut(bytes.data(), size);
    EXPECT_FALSE(take_origin(cut)) << size;
  }
  std::vector<std::uint8_t> nameless(20, 0);
  std::span<const std::uint8_t> rest(nameless);
  EXPECT_FALSE(take_origin(rest));
  bytes[1] = '\n';
  rest = bytes;
  EXPECT_FALSE(take_origin(rest)) << "a name has no control characters";
}

TEST(GatewayOrigin, ANameThatIsNotPlainTextIsMalformed) {
  for (const char* name : {"\xff\xfe", "a\xc3", "\u009b2J", "a\u202Eb", "\u2028", "a\u200Bb"}) {
    std::vector<std::uint8_t> bytes;
    append_origin({name, 1, 2, 3}, bytes);
    std::span<const std::uint8_t> rest(bytes);
    EXPECT_FALSE(take_origin(rest)) << name;
    EXPECT_EQ(rest.size(), bytes.size()) << "nothing is taken";
  }
}

}  // namespace
}  // namespace swarmtalk::daemon
