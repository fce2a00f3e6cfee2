#include "platforms/argos/footbot_controller.hpp"

#include <argos3/plugins/robots/generic/control_interface/ci_differential_steering_actuator.h>
#include <argos3/plugins/robots/generic/control_interface/ci_leds_actuator.h>
#include <argos3/plugins/robots/generic/control_interface/ci_range_and_bearing_actuator.h>
#include <argos3/plugins/robots/generic/control_interface/ci_range_and_bearing_sensor.h>

#include "swarmtalk/profiles/footbot_frame.hpp"

namespace swarmtalk::platforms::in_argos {
namespace {

using core::FootbotFrame;

}  // namespace

void FootbotController::connect() {
  wheels_ = GetActuator<argos::CCI_DifferentialSteeringActuator>("differential_steering");
  sender_ = GetActuator<argos::CCI_RangeAndBearingActuator>("range_and_bearing");
  receiver_ = GetSensor<argos::CCI_RangeAndBearingSensor>("range_and_bearing");
  if (HasActuator("leds")) leds_ = GetActuator<argos::CCI_LEDsActuator>("leds");
  if (sender_->GetSize() != FootbotFrame::kBytes) {
    THROW_ARGOSEXCEPTION("robot " << GetId() << " has a board of " << sender_->GetSize()
                                  << " bytes: write rab_data_size=\"" << +FootbotFrame::kBytes
                                  << "\" into its <foot-bot>");
  }
}

void FootbotController::Reset() {
  Controller::Reset();
  is_sending_ = false;
}

void FootbotController::ControlStep() {
  // The board has no collisions: what was on it in this step has been heard by all in sight.
  begin_step(is_sending_);
  for (const auto& reading : receiver_->GetReadings()) {
    const uint8_t* bytes = reading.Data.ToCArray();
    if (reading.Data.Size() != FootbotFrame::kBytes || (bytes[0] & FootbotFrame::kNew) == 0) {
      continue;
    }
    robot().hear(bytes + 1, bytes[0] & FootbotFrame::kLengthMask, reading.Range * kMmPerCm,
                 reading.HorizontalBearing.GetValue());
  }
  robot().run();
  const Wheels& wheels = robot().wheels();
  wheels_->SetLinearVelocity(wheels.left_mm_per_s / kMmPerCm, wheels.right_mm_per_s / kMmPerCm);
  if (leds_ != nullptr && has_new_colour()) {
    const Colour colour = robot().colour();
    leds_->SetAllColors(argos::CColor(colour.red, colour.green, colour.blue));
  }
  show_packet();
}

/// On the board for one step: it would be heard again in each step in which it stays.
void FootbotController::show_packet() {
  const bool was_sending = is_sending_;
  is_sending_ = robot().packet_bytes() != 0;
  if (is_sending_) {
    sender_->ClearData();
    const uint16_t size = robot().packet_bytes();
    sender_->SetData(0, static_cast<uint8_t>(FootbotFrame::kNew | size));
    for (uint16_t i = 0; i < size; ++i) sender_->SetData(i + 1u, robot().packet()[i]);
  } else if (was_sending) {
    sender_->ClearData();
  }
}

}  // namespace swarmtalk::platforms::in_argos
