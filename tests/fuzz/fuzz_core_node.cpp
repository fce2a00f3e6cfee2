// A node of each shipped profile that hears whatever comes (core_node_driver.hpp). Input: byte 0
// picks the profile, the rest is the script.
#include "swarmtalk/profiles/classic2020.hpp"
#include "swarmtalk/profiles/footbot.hpp"
#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#include "tests/fuzz/core_node_driver.hpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace swarmtalk::core;
  fuzz::run_one_of<Kilobot, Classic2020, Footbot, Wifi>(data, size);
  return 0;
}
