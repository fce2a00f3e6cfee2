// A program that does nothing: what the hardware layer costs by itself, and where to start.
#include "platforms/kilobot/runtime.hpp"

namespace {

using swarmtalk::kilobot::IrMessage;
using swarmtalk::kilobot::IrReception;

void setup() {}
void loop() {}
void receive(const IrReception&) {}
bool next(IrMessage&) {
  return false;
}

}  // namespace

int main() {
  swarmtalk::kilobot::run_program({&setup, &loop, &receive, &next});
}
