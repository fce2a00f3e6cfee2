// A node that hears whatever comes (core_node_driver.hpp), of profiles that nobody ships: drawn
// ones (generated_profile.hpp) and hard ones (core_profiles.hpp). Input: byte 0 picks the part,
// byte 1 the profile in it, the rest is the script.
#include "tests/fuzz/core_profiles.hpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace swarmtalk::core::fuzz;
  if (size == 0) return 0;
  switch (data[0] % kParts) {
    case 0:
      run_part<0>(data + 1, size - 1);
      break;
    case 1:
      run_part<1>(data + 1, size - 1);
      break;
    case 2:
      run_part<2>(data + 1, size - 1);
      break;
    case 3:
      run_part<3>(data + 1, size - 1);
      break;
  }
  return 0;
}
