// ARGoS's Kilobot: carries packets, LED and wheels between the plugin's devices and a robot. Needs
// argos3-kilobot.
#pragma once

#include <memory>

#include "platforms/argos/controller.hpp"

namespace argos {
class CCI_DifferentialSteeringActuator;
class CCI_KilobotCommunicationActuator;
class CCI_KilobotCommunicationSensor;
class CCI_KilobotLEDActuator;
}  // namespace argos

namespace swarmtalk::platforms::in_argos {

class KilobotController : public Controller {
 public:
  explicit KilobotController(MakeRobot make);
  ~KilobotController() override;
  void Reset() override;
  void ControlStep() override;

 protected:
  void connect() override;

 private:
  struct Messages;  // of kilolib's type, whose header defines macros that nobody wants

  argos::CCI_DifferentialSteeringActuator* wheels_ = nullptr;
  argos::CCI_KilobotLEDActuator* led_ = nullptr;
  argos::CCI_KilobotCommunicationActuator* sender_ = nullptr;
  argos::CCI_KilobotCommunicationSensor* receiver_ = nullptr;
  std::unique_ptr<Messages> messages_;
};

}  // namespace swarmtalk::platforms::in_argos
