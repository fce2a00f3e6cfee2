// ARGoS's foot-bot: carries packets over the range-and-bearing board, LEDs and wheels between
// ARGoS's devices and a robot.
#pragma once

#include "platforms/argos/controller.hpp"

namespace argos {
class CCI_DifferentialSteeringActuator;
class CCI_LEDsActuator;
class CCI_RangeAndBearingActuator;
class CCI_RangeAndBearingSensor;
}  // namespace argos

namespace swarmtalk::platforms::in_argos {

class FootbotController : public Controller {
 public:
  using Controller::Controller;
  void Reset() override;
  void ControlStep() override;

 protected:
  void connect() override;

 private:
  void show_packet();

  argos::CCI_DifferentialSteeringActuator* wheels_ = nullptr;
  argos::CCI_LEDsActuator* leds_ = nullptr;  // null: the experiment has none
  argos::CCI_RangeAndBearingActuator* sender_ = nullptr;
  argos::CCI_RangeAndBearingSensor* receiver_ = nullptr;
  bool is_sending_ = false;
};

}  // namespace swarmtalk::platforms::in_argos
