// swarmtalk-wifi-medium SEED NAME=ADDRESS@X,Y...: the air between the simulated radios of a Wi-Fi
// guest. Takes commands from standard input (air.hpp), answers each with a line of JSON, and ends
// when that does; the kernel's own medium, which loses nothing, then takes over again.
#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <stdexcept>
#include <string>

#include "lab/wifi/medium/air.hpp"
#include "lab/wifi/medium/hwsim_socket.hpp"

namespace {

using namespace swarmtalk::wifi;

constexpr std::size_t kMaxLine = 1024;

void add_radio(Air& air, const std::string& word) {
  char name[33];
  unsigned bytes[6];
  double x_m = 0;
  double y_m = 0;
  const int fields =
      std::sscanf(word.c_str(), "%32[^=]=%2x:%2x:%2x:%2x:%2x:%2x@%lf,%lf", name, &bytes[0],
                  &bytes[1], &bytes[2], &bytes[3], &bytes[4], &bytes[5], &x_m, &y_m);
  if (fields != 9) throw std::runtime_error("'" + word + "' is not NAME=ADDRESS@X,Y");
  Address address{};
  for (std::size_t i = 0; i < address.size(); ++i) {
    address[i] = static_cast<std::uint8_t>(bytes[i]);
  }
  if (!air.add(name, address, x_m, y_m)) {
    throw std::runtime_error("'" + word + "': one radio too many, or there twice");
  }
}

/// Answers the lines that have come. @return false at the end of the input
bool take_commands(Air& air, std::string& line) {
  char buffer[kMaxLine];
  const ssize_t size = read(STDIN_FILENO, buffer, sizeof buffer);
  if (size <= 0) return false;
  for (const char* c = buffer; c != buffer + size; ++c) {
    if (*c != '\n') {
      if (line.size() < kMaxLine) line += *c;
      continue;
    }
    std::printf("%s\n", air.command(line).c_str());
    line.clear();
  }
  std::fflush(stdout);
  return true;
}

void serve(Air& air) {
  HwsimSocket socket;
  std::printf("{\"ready\":true}\n");
  std::fflush(stdout);
  const HwsimSocket::OnFrame on_frame = [&](const Frame& frame, const Ticket& ticket) {
    const Outcome outcome = air.transmit(frame);
    for (const Reception& reception : outcome.receptions) {
      socket.deliver(frame, air.address(reception.radio), reception.rate_index,
                     reception.signal_dbm);
    }
    const int signal = outcome.receptions.empty() ? -100 : outcome.receptions[0].signal_dbm;
    socket.report(ticket, outcome, signal);
  };
  std::string line;
  for (;;) {
    pollfd waits[] = {{STDIN_FILENO, POLLIN, 0}, {socket.fd(), POLLIN, 0}};
    if (poll(waits, 2, -1) < 0) continue;
    if (waits[0].revents != 0 && !take_commands(air, line)) return;
    if (waits[1].revents != 0) socket.read(on_frame, air);
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc < 2) throw std::runtime_error("usage: swarmtalk-wifi-medium SEED NAME=ADDRESS@X,Y...");
    Air air(std::strtoull(argv[1], nullptr, 10));
    for (int i = 2; i < argc; ++i) add_radio(air, argv[i]);
    serve(air);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "swarmtalk-wifi-medium: %s\n", error.what());
    return 1;
  }
}
