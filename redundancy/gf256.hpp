// GF(256), the field of bytes: sums are XOR, products are those of polynomials over bits modulo
// x^8 + x^4 + x^3 + x^2 + 1 (0x11D), of which 2 is a generator.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace swarmtalk::redundancy::gf256 {

inline constexpr unsigned kPolynomial = 0x11D;
inline constexpr unsigned kOrder = 255;  // of the generator

struct Tables {
  std::array<std::uint8_t, 2 * kOrder> powers{};  // of 2; twice, so that a sum of two is in it
  std::array<std::uint8_t, 256> logarithms{};     // to base 2; of 0 there is none
};

constexpr Tables make_tables() {
  Tables tables;
  unsigned power = 1;
  for (unsigned exponent = 0; exponent < kOrder; ++exponent) {
    tables.powers[exponent] = tables.powers[exponent + kOrder] = static_cast<std::uint8_t>(power);
    tables.logarithms[power] = static_cast<std::uint8_t>(exponent);
    power <<= 1;
    if (power > 0xFF) power ^= kPolynomial;
  }
  return tables;
}
inline constexpr Tables kTables = make_tables();

constexpr std::uint8_t multiply(std::uint8_t a, std::uint8_t b) {
  if (a == 0 || b == 0) return 0;
  return kTables.powers[std::size_t{kTables.logarithms[a]} + kTables.logarithms[b]];
}

/// @pre b is not 0
constexpr std::uint8_t divide(std::uint8_t a, std::uint8_t b) {
  if (a == 0) return 0;
  return kTables.powers[std::size_t{kTables.logarithms[a]} + kOrder - kTables.logarithms[b]];
}

}  // namespace swarmtalk::redundancy::gf256
