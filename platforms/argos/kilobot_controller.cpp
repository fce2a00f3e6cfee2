#include "platforms/argos/kilobot_controller.hpp"

#include <argos3/plugins/robots/generic/control_interface/ci_differential_steering_actuator.h>
#include <argos3/plugins/robots/kilobot/control_interface/ci_kilobot_led_actuator.h>
// The last: they define macros called main, RED, GREEN and BLUE.
#include <argos3/plugins/robots/kilobot/control_interface/ci_kilobot_communication_actuator.h>
#include <argos3/plugins/robots/kilobot/control_interface/ci_kilobot_communication_sensor.h>

#include <cmath>
#include <cstring>

namespace swarmtalk::platforms::in_argos {
namespace {

// Types of infrared messages (docs/kilobot.md): a robot's, and the overhead controller's, whose
// distance means nothing.
constexpr uint8_t kFromRobot = 2;
constexpr uint8_t kFromOverhead = 3;

}  // namespace

/// Two, because the plugin keeps the pointer: receivers read a message that has left while its
/// sender prepares the next.
struct KilobotController::Messages {
  message_t messages[2] = {};
  int next = 0;
};

KilobotController::KilobotController(MakeRobot make)
    : Controller(make), messages_(std::make_unique<Messages>()) {}

KilobotController::~KilobotController() = default;

void KilobotController::connect() {
  wheels_ = GetActuator<argos::CCI_DifferentialSteeringActuator>("differential_steering");
  led_ = GetActuator<argos::CCI_KilobotLEDActuator>("kilobot_led");
  sender_ = GetActuator<argos::CCI_KilobotCommunicationActuator>("kilobot_communication");
  receiver_ = GetSensor<argos::CCI_KilobotCommunicationSensor>("kilobot_communication");
}

void KilobotController::Reset() {
  Controller::Reset();
  *messages_ = Messages{};
}

void KilobotController::ControlStep() {
  const bool was_sent = receiver_->MessageSent();
  if (was_sent) messages_->next ^= 1;
  begin_step(was_sent);
  for (const auto& packet : receiver_->GetPackets()) {
    const message_t& message = *packet.Message;
    if (message.type != kFromRobot && message.type != kFromOverhead) continue;
    const double distance_mm =
        message.type == kFromRobot ? static_cast<double>(packet.Distance.high_gain) : std::nan("");
    robot().hear(message.data, sizeof message.data, distance_mm, 0);
  }
  robot().run();
  const Wheels& wheels = robot().wheels();
  wheels_->SetLinearVelocity(wheels.left_mm_per_s / kMmPerCm, wheels.right_mm_per_s / kMmPerCm);
  if (has_new_colour()) {
    const Colour colour = robot().colour();
    led_->SetColor(argos::CColor(colour.red, colour.green, colour.blue));
  }
  if (robot().packet_bytes() != 0) {
    message_t& message = messages_->messages[messages_->next];
    std::memcpy(message.data, robot().packet(), robot().packet_bytes());
    message.type = kFromRobot;
    sender_->SetMessage(&message);
  }
}

}  // namespace swarmtalk::platforms::in_argos
