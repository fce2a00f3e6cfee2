// What a run writes down: one JSON object a line, the same on every platform, from which the
// suite's metrics are worked out (docs/suite.md). One Recorder per robot or per simulated swarm;
// not shared between threads.
#pragma once

#include <cstdarg>
#include <cstdint>
#include <cstdio>

#include "platforms/robot.hpp"

namespace swarmtalk::platforms {

class Recorder {
 public:
  /// @param file  written to, not owned; null: nothing is written
  explicit Recorder(std::FILE* file) : file_(file) {}

  bool is_on() const { return file_ != nullptr; }

  /// One event of robot `robot` (from 0) at `time_us`.
  /// @param format  the event's name and fields as JSON, without braces
  __attribute__((format(printf, 4, 5))) void event(uint64_t time_us, uint32_t robot,
                                                   const char* format, ...) {
    if (file_ == nullptr) return;
    std::fprintf(file_, "{\"t\":%llu,\"robot\":%u,", static_cast<unsigned long long>(time_us),
                 static_cast<unsigned>(robot));
    va_list arguments;
    va_start(arguments, format);
    std::vfprintf(file_, format, arguments);
    va_end(arguments);
    std::fputs("}\n", file_);
  }

  void led(uint64_t time_us, uint32_t robot, Colour colour) {
    event(time_us, robot, "\"event\":\"led\",\"rgb\":[%d,%d,%d]", colour.red, colour.green,
          colour.blue);
  }
  void value(uint64_t time_us, uint32_t robot, const char* name, int32_t number) {
    event(time_us, robot, "\"event\":\"value\",\"name\":\"%s\",\"value\":%d", name, number);
  }
  void pose(uint64_t time_us, uint32_t robot, double x_mm, double y_mm, double theta_rad) {
    event(time_us, robot, "\"event\":\"pose\",\"x_mm\":%.1f,\"y_mm\":%.1f,\"theta\":%.3f", x_mm,
          y_mm, theta_rad);
  }
  void sent(uint64_t time_us, uint32_t robot, uint32_t channel, uint32_t bytes) {
    event(time_us, robot, "\"event\":\"sent\",\"channel\":%u,\"bytes\":%u", channel, bytes);
  }
  /// @param node  id of the origin; @param message  its number, as far as the wire has it
  void received(uint64_t time_us, uint32_t robot, uint32_t channel, uint32_t node, uint32_t message,
                long distance_mm) {
    event(time_us, robot,
          "\"event\":\"received\",\"channel\":%u,\"node\":%u,\"message\":%u,\"mm\":%ld", channel,
          node, message, distance_mm);
  }

 private:
  std::FILE* file_;
};

}  // namespace swarmtalk::platforms
