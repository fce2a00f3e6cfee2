// The source of chance of the daemon, its drivers, the bridge and the client library: node ids,
// epochs, jitter, numbers of questions. A test that turns the clock seeds it. What an attacker must
// not guess comes from libsodium (frame/sealing.hpp).
#pragma once

#include <cstdint>

namespace swarmtalk::loop {

/// Random bits from the kernel. @throws std::runtime_error
std::uint32_t random_bits();

}  // namespace swarmtalk::loop
