// swarmtalk-sim with another profile and one program only, as `swarmtalk-suite sweep` compiles it:
// SWARMTALK_SWEPT names a header that the sweep has written, with SweptProfile, SweptProgram and
// kSweptProgram. With --profile it prints what the profile's numbers come to, as JSON.
#include SWARMTALK_SWEPT

#include <cstring>

#include "suite/sim/run_scenario.hpp"

int main(int argc, char** argv) {
  using namespace swarmtalk;
  using W = core::Wire<suite::SweptProfile>;
  if (argc == 2 && std::strcmp(argv[1], "--profile") == 0) {
    std::printf(
        "{\"packet_bytes\":%u,\"header_bytes\":%u,\"payload_bytes\":%u,\"ttl_max\":%u,"
        "\"message_bytes\":%u,\"buffer_bytes\":%llu}\n",
        static_cast<unsigned>(W::kMtuBytes), static_cast<unsigned>(W::kHeaderBytes),
        static_cast<unsigned>(W::kPayloadBytes), static_cast<unsigned>(W::kTtlMax),
        static_cast<unsigned>(W::kMessageBytes), static_cast<unsigned long long>(W::kBufferBytes));
    return 0;
  }
  return suite::simulator_main<suite::SweptProfile>(
      argc, argv, [](auto* robot, const std::string& name, auto run) {
        using Robot = std::remove_pointer_t<decltype(robot)>;
        if (name != suite::kSweptProgram) return false;
        run(static_cast<suite::SweptProgram<Robot>*>(nullptr));
        return true;
      });
}
