// Home of programs of 2020 on Linux: link it with a program that includes "swarmtalk.h" and defines
// setup() and loop(), with this folder in the include path and the program's macros (PKT_SIZE ...)
// or its config.h given to both. Each process is a robot; the robots on one machine hear each other
// through sockets in a folder, without privileges. LED and motors are printed when they change.
//
// Environment: SWARMTALK_AIR the folder (default /tmp/swarmtalk-air); SWARMTALK_X_MM,
// SWARMTALK_Y_MM where the robot stands (0); SWARMTALK_RANGE_MM how far it hears (unlimited);
// SWARMTALK_SPEED how many times faster than a Kilobot its time passes (1).
#include <dirent.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <random>
#include <string>

#define SWARMTALK_CLASSIC_NO_GLOBALS
#include "core/classic/swarmtalk.h"

namespace {

/// What goes through a socket.
struct Frame {
  int32_t x_mm;
  int32_t y_mm;
  uint8_t packet[PKT_SIZE];
};
constexpr int kTickUs = 32'768;      // a Kilobot's
constexpr unsigned kSlotTicks = 16;  // between two packets of a robot, on average

/// @param least  the smallest number that makes sense
double environment(const char* name, double otherwise, double least) {
  const char* text = std::getenv(name);
  if (text == nullptr) return otherwise;
  char* end = nullptr;
  const double value = std::strtod(text, &end);
  if (end == text || *end != '\0' || !std::isfinite(value)) {
    std::fprintf(stderr, "%s is '%s': give it a number\n", name, text);
    std::exit(1);
  }
  if (value < least) {
    std::fprintf(stderr, "%s is '%s': give it at least %g\n", name, text, least);
    std::exit(1);
  }
  return value;
}

double speed = 1;
std::mt19937 random_source{std::random_device{}()};
volatile std::sig_atomic_t is_ending = 0;

unsigned int read_clock() {
  timespec now = {};
  clock_gettime(CLOCK_MONOTONIC, &now);
  const double us = static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) / 1e3;
  return static_cast<unsigned int>(static_cast<uint64_t>(us * speed / kTickUs));
}

/// The sockets of all robots in one folder.
class Air {
 public:
  Air() {
    const char* folder = std::getenv("SWARMTALK_AIR");
    folder_ = folder == nullptr ? "/tmp/swarmtalk-air" : folder;
    mkdir(folder_.c_str(), 0777);
    mine_ = folder_ + "/robot-" + std::to_string(getpid());
    socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const sockaddr_un address = address_of(mine_);
    unlink(mine_.c_str());
    if (socket_ < 0 || bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address)) {
      std::fprintf(stderr, "cannot make %s: %s. SWARMTALK_AIR names the folder for it\n",
                   mine_.c_str(), std::strerror(errno));
      std::exit(1);
    }
  }
  ~Air() {
    close(socket_);
    unlink(mine_.c_str());
  }
  Air(const Air&) = delete;
  Air& operator=(const Air&) = delete;

  /// To every other robot. One whose queue is full misses the frame; one that is gone is removed.
  void send(const Frame& frame) const {
    DIR* folder = opendir(folder_.c_str());
    if (folder == nullptr) return;
    while (const dirent* entry = readdir(folder)) {
      const std::string path = folder_ + "/" + entry->d_name;
      if (std::strncmp(entry->d_name, "robot-", 6) != 0 || path == mine_) continue;
      const sockaddr_un to = address_of(path);
      if (sendto(socket_, &frame, sizeof frame, 0, reinterpret_cast<const sockaddr*>(&to),
                 sizeof to) < 0 &&
          errno == ECONNREFUSED) {
        unlink(path.c_str());
      }
    }
    closedir(folder);
  }
  /// @return false if nothing waits
  bool receive(Frame& frame) const {
    ssize_t size = 0;
    do {
      size = recv(socket_, &frame, sizeof frame, MSG_TRUNC);
    } while (size >= 0 && size != sizeof frame);  // of robots with other packets
    return size == sizeof frame;
  }
  void wait(int ms) const {
    pollfd waiting = {socket_, POLLIN, 0};
    poll(&waiting, 1, ms);
  }

 private:
  static sockaddr_un address_of(const std::string& path) {
    sockaddr_un address = {};
    address.sun_family = AF_UNIX;
    if (path.size() >= sizeof address.sun_path) {
      std::fprintf(stderr, "%s is too long for a socket: choose a shorter SWARMTALK_AIR\n",
                   path.c_str());
      std::exit(1);
    }
    std::memcpy(address.sun_path, path.c_str(), path.size());
    return address;
  }
  std::string folder_;
  std::string mine_;
  int socket_ = -1;
};

void show(int red, int green, int blue) {
  std::printf("led %d %d %d\n", red, green, blue);
}
void move(int status) {
  static const char* const kNames[] = {"stop", "forward", "left", "right"};
  std::printf("motor %s\n", kNames[status & 3]);
}

void start_program() {
  SwarmTalk::compare_macros_with_the_program();
  swarmtalk_instance.sys.set_common_sys_get_clock(&read_clock);
  swarmtalk_instance.sys.set_common_sys_random_func(
      [] { return static_cast<unsigned int>(random_source()); });
  swarmtalk_instance.led.set_driver(&show, &read_clock);
  swarmtalk_instance.motor.set_driver(&move, &read_clock);
  swarmtalk_instance.register_user_loop(&loop);
  swarmtalk_instance.init();
  setup();
}

}  // namespace

int main() {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  for (int number : {SIGINT, SIGTERM, SIGHUP}) {
    if (std::signal(number, SIG_IGN) == SIG_IGN) continue;  // as nohup does
    std::signal(number, [](int) { is_ending = 1; });
  }
  speed = environment("SWARMTALK_SPEED", 1, 0.01);
  const double x_mm = environment("SWARMTALK_X_MM", 0, -1e9);
  const double y_mm = environment("SWARMTALK_Y_MM", 0, -1e9);
  const double range_mm = environment("SWARMTALK_RANGE_MM", INFINITY, 0);
  const Air air;
  start_program();
  Frame frame = {};
  unsigned next_slot = read_clock() + random_source() % kSlotTicks;
  while (is_ending == 0) {
    swarmtalk_instance.execute_loop();
    while (air.receive(frame)) {
      const double distance_mm = std::hypot(frame.x_mm - x_mm, frame.y_mm - y_mm);
      Meta_t meta = {};
      meta.dist = static_cast<int>(std::lround(distance_mm));
      if (distance_mm <= range_mm) swarmtalk_instance.receive(frame.packet, PKT_SIZE, &meta);
    }
    if (static_cast<int32_t>(read_clock() - next_slot) >= 0) {
      next_slot = read_clock() + kSlotTicks - 1 + random_source() % 3;
      if (swarmtalk_instance.next_pkt(frame.packet) != 0) {
        frame.x_mm = static_cast<int32_t>(x_mm);
        frame.y_mm = static_cast<int32_t>(y_mm);
        air.send(frame);
      }
    }
    air.wait(static_cast<int>(kTickUs / 1000 / speed) + 1);
  }
  return 0;
}
