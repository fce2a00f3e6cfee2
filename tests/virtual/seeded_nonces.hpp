// What libsodium draws (sessions and nonces of sealed frames) comes from loop/chance.hpp, as all
// other chance.
#pragma once

namespace swarmtalk::test {

void seed_nonces();

}  // namespace swarmtalk::test
