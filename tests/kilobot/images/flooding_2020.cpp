// flooding.hpp with the packets of 2020, whose library drew each message's number at random.
#include "tests/kilobot/images/flooding.hpp"

#include "platforms/kilobot/join.hpp"

volatile uint16_t flooding_sent;
volatile uint16_t flooding_heard;
volatile uint16_t flooding_first;
volatile uint16_t flooding_twice;
volatile uint16_t flooding_own_back;
volatile uint8_t flooding_node_id;
volatile uint8_t flooding_id_changes;

namespace {

using namespace swarmtalk;

/// Gives its own messages, of one packet each, random numbers on their way out.
class RobotOf2020 : public kilobot::ClassicKilobotRobot {
 public:
  bool next(kilobot::IrMessage& out) {
    using W = core::Wire<Profile>;
    if (!kilobot::ClassicKilobotRobot::next(out)) return false;
    if (W::NodeField::get(out.data) == flooding_node_id) {
      W::MessageField::put(out.data, static_cast<uint8_t>(random() & W::kMessageMask));
    }
    return true;
  }
};

kilobot::Joined<kilobot::Flooding, RobotOf2020> joined(kilobot::read_uid());

}  // namespace

int main() {
  joined.run();
}
