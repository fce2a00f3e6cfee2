// OwnNonces: what a nonce that comes back proves, and for how long.
#include "frame/own_nonces.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace swarmtalk::frame {
namespace {

using Nonce = OwnNonces::Nonce;

/// Draws 1 1 1 1 1 1, then 2 2 2 2 2 2, ...
OwnNonces::Draw counting() {
  return [next = std::uint8_t{0}](std::span<std::uint8_t> out) mutable {
    ++next;
    for (std::uint8_t& byte : out) byte = next;
  };
}
Nonce of(std::uint8_t number) {
  Nonce nonce;
  nonce.fill(number);
  return nonce;
}
std::vector<std::uint8_t> joined(std::initializer_list<Nonce> nonces) {
  std::vector<std::uint8_t> bytes;
  for (const Nonce& nonce : nonces) bytes.insert(bytes.end(), nonce.begin(), nonce.end());
  return bytes;
}

TEST(OwnNonces, AreDrawnOnceASecond) {
  OwnNonces nonces;
  const auto draw = counting();
  nonces.roll(5000, draw);
  EXPECT_EQ(nonces.newest(), of(1));
  nonces.roll(5000 + OwnNonces::kRollMs - 1, draw);
  EXPECT_EQ(nonces.newest(), of(1));
  nonces.roll(5000 + OwnNonces::kRollMs, draw);
  EXPECT_EQ(nonces.newest(), of(2));
}

TEST(OwnNonces, ProveByTheNewestThatComesBack) {
  OwnNonces nonces;
  const auto draw = counting();
  nonces.roll(1000, draw);
  nonces.roll(2000, draw);
  EXPECT_EQ(nonces.proof_in(joined({of(9), of(1)}), 2100), 1000u);
  EXPECT_EQ(nonces.proof_in(joined({of(1), of(2)}), 2100), 2000u);
  EXPECT_EQ(nonces.proof_in(joined({of(9)}), 2100), std::nullopt);
  EXPECT_EQ(nonces.proof_in({}, 2100), std::nullopt);
}

TEST(OwnNonces, ProveNothingAfterAWhile) {
  OwnNonces nonces;
  nonces.roll(1000, counting());
  EXPECT_EQ(nonces.proof_in(joined({of(1)}), 1000 + OwnNonces::kAnswerMs), 1000u);
  EXPECT_EQ(nonces.proof_in(joined({of(1)}), 1001 + OwnNonces::kAnswerMs), std::nullopt);
}

TEST(OwnNonces, ProveNoTimeAfterTheFrameCame) {  // its arrival was stamped before we drew
  OwnNonces nonces;
  nonces.roll(1000, counting());
  EXPECT_EQ(nonces.proof_in(joined({of(1)}), 990), 990u);
}

TEST(OwnNonces, OfLongAgoAreForgotten) {
  OwnNonces nonces;
  const auto draw = counting();
  for (std::uint64_t n = 0; n <= OwnNonces::kKept; ++n) nonces.roll(n * OwnNonces::kRollMs, draw);
  EXPECT_EQ(nonces.proof_in(joined({of(1)}), 0), std::nullopt);
  EXPECT_EQ(nonces.proof_in(joined({of(2)}), 0), 0u);
}

TEST(OwnNonces, CutShortProveNothing) {
  OwnNonces nonces;
  nonces.roll(1000, counting());
  EXPECT_EQ(nonces.proof_in(std::vector<std::uint8_t>(5, 1), 1000), std::nullopt);
}

}  // namespace
}  // namespace swarmtalk::frame
