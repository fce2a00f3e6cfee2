// Sends COUNT messages and ends, as a first program does: it does not run, and waits for nothing.
// Arguments: COUNT; "wait": says that it is ready, and waits for a line before it sends.
#include <cstdlib>
#include <iostream>
#include <string>
#include <swarmtalk/client.hpp>

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  swarmtalk::Client robot("leaving");
  auto publisher = robot.advertise("two");
  const bool waits = argc > 2;
  if (waits) {
    std::cout << "ready" << std::endl;
    std::cin.get();
  }
  for (int i = 0; i < std::atoi(argv[1]); ++i) {
    if (!publisher.send(std::to_string(i)) && !waits) return 1;
  }
  return 0;
}
