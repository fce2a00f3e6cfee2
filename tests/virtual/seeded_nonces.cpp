#include "tests/virtual/seeded_nonces.hpp"

#include <sodium.h>

#include <cstddef>
#include <cstdint>
#include <stdexcept>

#include "loop/chance.hpp"

namespace swarmtalk::test {
namespace {

void draw(void* const out, const std::size_t size) {
  auto* const bytes = static_cast<std::uint8_t*>(out);
  for (std::size_t i = 0; i < size; ++i) {
    bytes[i] = static_cast<std::uint8_t>(loop::random_bits() >> 24);
  }
}

randombytes_implementation seeded{
    [] { return "the seed of a test"; },  // implementation_name
    [] { return loop::random_bits(); },   // random
    nullptr,                              // stir
    nullptr,                              // uniform: made of random
    draw,                                 // buf
    nullptr,                              // close
};

}  // namespace

void seed_nonces() {
  if (sodium_init() < 0) throw std::runtime_error("libsodium does not start");
  randombytes_set_implementation(&seeded);
}

}  // namespace swarmtalk::test
