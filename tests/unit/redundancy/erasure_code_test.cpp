#include "redundancy/erasure_code.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "redundancy/gf256.hpp"

namespace swarmtalk::redundancy {
namespace {

TEST(Gf256, IsAField) {
  for (unsigned a = 0; a < 256; ++a) {
    const auto x = static_cast<std::uint8_t>(a);
    EXPECT_EQ(gf256::multiply(x, 1), x);
    EXPECT_EQ(gf256::multiply(x, 0), 0);
    if (a != 0) {
      EXPECT_EQ(gf256::multiply(x, gf256::divide(1, x)), 1) << a;
    }
  }
  // By hand: x^7 times x is x^8, that is x^4 + x^3 + x^2 + 1.
  EXPECT_EQ(gf256::multiply(0x80, 2), 0x1D);
  for (unsigned a = 1; a < 256; a += 7) {
    for (unsigned b = 0; b < 256; b += 5) {
      const auto x = static_cast<std::uint8_t>(a);
      const auto y = static_cast<std::uint8_t>(b);
      EXPECT_EQ(gf256::divide(gf256::multiply(x, y), x), y);
      const auto sum = static_cast<std::uint8_t>(y ^ 0x35);
      EXPECT_EQ(gf256::multiply(x, sum), gf256::multiply(x, y) ^ gf256::multiply(x, 0x35));
    }
  }
}

TEST(ErasureCode, BeginsWithTheXorOfAllPackets) {
  for (unsigned source = 0; source < kMostOfAKind; ++source) {
    EXPECT_EQ(coefficient(0, source), 1);
    EXPECT_NE(coefficient(5, source), 0);
  }
}

/// Every choice of packets and parity packets that are enough brings back every message.
TEST(ErasureCode, MakesUpForAnyLossOfAsManyPacketsAsThereAreParities) {
  constexpr unsigned kSources = 5;
  constexpr unsigned kParities = 4;
  constexpr std::size_t kBytes = 40;
  std::vector<Bytes> sources;
  for (unsigned i = 0; i < kSources; ++i) {
    Bytes& bytes = sources.emplace_back(i + 1 == kSources ? 11 : kBytes);  // the last is shorter
    for (std::size_t at = 0; at < bytes.size(); ++at) {
      bytes[at] = static_cast<std::uint8_t>(97 * i + at * at);
    }
  }
  std::vector<Parity> parities;
  for (unsigned parity = 0; parity < kParities; ++parity) {
    Bytes sum(kBytes);
    for (unsigned i = 0; i < kSources; ++i) add_product(sum, sources[i], coefficient(parity, i));
    parities.push_back({parity, sum});
  }
  for (unsigned mask = 0; mask < 1u << (kSources + kParities); ++mask) {
    std::vector<std::span<const std::uint8_t>> held(kSources);
    std::vector<Parity> heard;
    unsigned missing = 0;
    for (unsigned i = 0; i < kSources; ++i) {
      if ((mask >> i & 1) != 0) {
        held[i] = sources[i];
      } else {
        ++missing;
      }
    }
    for (unsigned i = 0; i < kParities; ++i) {
      if ((mask >> (kSources + i) & 1) != 0) heard.push_back(parities[i]);
    }
    const std::vector<Bytes> found = recover(held, heard);
    if (missing == 0 || heard.size() < missing) {
      EXPECT_TRUE(found.empty());
      continue;
    }
    ASSERT_EQ(found.size(), missing);
    unsigned next = 0;
    for (unsigned i = 0; i < kSources; ++i) {
      if (held[i].data() != nullptr) continue;
      Bytes padded = sources[i];
      padded.resize(kBytes);
      EXPECT_EQ(found[next++], padded) << "packets " << mask;
    }
  }
}

}  // namespace
}  // namespace swarmtalk::redundancy
