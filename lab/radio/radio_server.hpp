// RadioServer: the Wi-Fi medium of sim/ in real time. Reads what robots send on their ports, moves
// the medium's clock with the machine's, hands to each port what arrives there, and answers at the
// control socket. One thread; ends when it is told to by a signal.
//
// Frames that are read together came at different moments of the time since the last look; they get
// moments drawn from it, or those who happened to be read together would always collide.
#pragma once

#include <signal.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "lab/radio/control_socket.hpp"
#include "lab/radio/ghost_door.hpp"
#include "lab/radio/lateness.hpp"
#include "lab/radio/port.hpp"
#include "sim/random.hpp"
#include "sim/wifi_air.hpp"

namespace swarmtalk::lab::radio {

class RadioServer {
 public:
  /// @param air  range, loss, rate and their like
  /// @throws std::runtime_error  one line: no descriptors, no socket
  RadioServer(const sim::WifiAirConfig& air, const std::string& control_path, std::uint64_t seed);
  ~RadioServer();
  RadioServer(const RadioServer&) = delete;
  RadioServer& operator=(const RadioServer&) = delete;

  /// The next robot. All before run(); ghosts come while it runs, and go.
  void add(std::unique_ptr<Port> port, double x_m, double y_m);

  /// Serves until one of `signals` comes, which have to be blocked. @return which
  int run(const sigset_t& signals);

 private:
  struct Arrival {
    std::uint64_t at_us;
    std::uint32_t station;
    std::vector<std::uint8_t> frame;
  };
  enum Tag : std::uint32_t { kTimer, kControl, kSignal, kDoor, kFirstPort };

  std::uint64_t clock_us() const;
  void watch(int fd, std::uint32_t tag);
  void arm_timer();
  void read_port(std::uint32_t station, std::uint64_t since_us, std::uint64_t now_us);
  void offer_arrivals();
  void answer_requests();
  void let_ghosts_in();
  void place_ghost(std::uint32_t station, std::span<const std::uint8_t> packet);
  void let_ghost_out(std::uint32_t station);

  std::uint64_t start_us_ = 0;
  int epoll_ = -1;
  int timer_ = -1;
  ControlSocket control_;
  GhostDoor door_;
  Lateness lateness_;
  std::vector<std::unique_ptr<Port>> ports_;
  std::vector<std::uint32_t> free_;  // stations of ghosts that have gone
  std::vector<bool> is_placed_;      // by ghost: has told where it is
  std::uint32_t robots_ = 0;         // the stations behind them are ghosts'
  sim::WifiAir air_;
  sim::Random random_;
  std::vector<Arrival> arrivals_;
  std::string scheduling_;
};

}  // namespace swarmtalk::lab::radio
