// Must not compile: a robot whose clock has other ticks than programs count in. The test looks for
// the sentence. (With 31 this compiles.)
#include "platforms/example/minimal_port.hpp"
#include "suite/programs/edge_following.hpp"
#include "suite/programs/firefly.hpp"
#include "suite/programs/hop_count.hpp"

class FastRobot : public swarmtalk::platforms::ExampleRobot {
 public:
  using swarmtalk::platforms::ExampleRobot::ExampleRobot;
  static constexpr uint32_t kTicksPerSecond = TICKS_PER_SECOND;
};

static_assert(sizeof(swarmtalk::suite::PROGRAM<FastRobot>) != 0, "");
