#include "redundancy/erasure_code.hpp"

#include <array>
#include <utility>

#include "redundancy/gf256.hpp"

namespace swarmtalk::redundancy {
namespace {

/// Makes place `row` of each column but `column` zero and that of `column` one, in the square
/// `matrix`, and does the same to what it is multiplied with. @pre such a row there is
void eliminate(std::vector<Bytes>& matrix, std::vector<Bytes>& values, std::size_t column) {
  std::size_t pivot = column;
  while (matrix[pivot][column] == 0) ++pivot;
  std::swap(matrix[pivot], matrix[column]);
  std::swap(values[pivot], values[column]);
  const std::uint8_t inverse = gf256::divide(1, matrix[column][column]);
  for (Bytes* bytes : {&matrix[column], &values[column]}) {
    for (std::uint8_t& byte : *bytes) byte = gf256::multiply(byte, inverse);
  }
  for (std::size_t row = 0; row < matrix.size(); ++row) {
    if (row == column || matrix[row][column] == 0) continue;
    const std::uint8_t factor = matrix[row][column];
    add_product(matrix[row], matrix[column], factor);
    add_product(values[row], values[column], factor);
  }
}

}  // namespace

std::uint8_t coefficient(unsigned parity, unsigned source) {
  const auto y = static_cast<std::uint8_t>(source);
  const auto x = [](unsigned row) { return static_cast<std::uint8_t>(kMostOfAKind + row); };
  return gf256::divide(x(0) ^ y, x(parity) ^ y);
}

void add_product(std::span<std::uint8_t> to, std::span<const std::uint8_t> from,
                 std::uint8_t factor) {
  if (factor == 0) return;
  std::array<std::uint8_t, 256> products;
  for (std::size_t byte = 0; byte < products.size(); ++byte) {
    products[byte] = gf256::multiply(static_cast<std::uint8_t>(byte), factor);
  }
  for (std::size_t i = 0; i < from.size(); ++i) {
    to[i] = static_cast<std::uint8_t>(to[i] ^ products[from[i]]);
  }
}

std::vector<Bytes> recover(std::span<const std::span<const std::uint8_t>> sources,
                           std::span<const Parity> parities) {
  std::vector<unsigned> missing;
  for (unsigned i = 0; i < sources.size(); ++i) {
    if (sources[i].data() == nullptr) missing.push_back(i);
  }
  if (missing.empty() || parities.size() < missing.size()) return {};
  std::vector<Bytes> matrix;  // times the missing ones is...
  std::vector<Bytes> values;  // ... the parities without the packets that are there
  for (const Parity& parity : parities.first(missing.size())) {
    Bytes& row = matrix.emplace_back();
    for (const unsigned source : missing) row.push_back(coefficient(parity.index, source));
    Bytes& value = values.emplace_back(parity.bytes);
    for (unsigned i = 0; i < sources.size(); ++i) {
      add_product(value, sources[i], coefficient(parity.index, i));
    }
  }
  for (std::size_t column = 0; column < missing.size(); ++column) {
    eliminate(matrix, values, column);
  }
  return values;
}

}  // namespace swarmtalk::redundancy
