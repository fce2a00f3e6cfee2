// LED_control and motor_control of 2020 programs: they remember what they were told and for how
// long; a driver gets the commands through two functions.
#pragma once

#include <stdint.h>

namespace SwarmTalk {

enum Motor_status { Stop, Move_forward, Turn_left, Turn_right };
enum Led_status { Off, On };

/// Time left of a command, in ticks of the node's clock.
class Timed_control {
 public:
  void begin(uint32_t now, uint32_t ticks) {
    since_ = now;
    ticks_ = ticks;
    is_running_ = true;
  }
  void cancel() { is_running_ = false; }
  /// @return true once, when the time is over
  bool is_over(uint32_t now) {
    if (!is_running_ || static_cast<uint32_t>(now - since_) < ticks_) return false;
    is_running_ = false;
    return true;
  }

 private:
  uint32_t since_ = 0;
  uint32_t ticks_ = 0;
  bool is_running_ = false;
};

class Led_control {
 public:
  using Driver = void (*)(int red, int green, int blue);
  void set_driver(Driver driver, unsigned int (*clock)()) {
    driver_ = driver;
    clock_ = clock;
  }
  void turn_on(int red, int green, int blue, int time) {
    status_ = On;
    if (driver_ != nullptr) driver_(red, green, blue);
    timer_.begin(now(), static_cast<uint32_t>(time));
  }
  void turn_off() { stay(0, 0, 0); }
  /// The same without an end.
  void stay(int red, int green, int blue) {
    status_ = red != 0 || green != 0 || blue != 0 ? On : Off;
    timer_.cancel();
    if (driver_ != nullptr) driver_(red, green, blue);
  }
  int current_status() const { return status_; }
  void update() {
    if (timer_.is_over(now())) turn_off();
  }

 private:
  uint32_t now() const { return clock_ == nullptr ? 0 : clock_(); }
  Timed_control timer_;
  Driver driver_ = nullptr;
  unsigned int (*clock_)() = nullptr;
  Led_status status_ = Off;
};

class Motor_control {
 public:
  using Driver = void (*)(int status);
  void set_driver(Driver driver, unsigned int (*clock)()) {
    driver_ = driver;
    clock_ = clock;
  }
  void move_forward(unsigned long time) { go(Move_forward, time); }
  void turn_left(unsigned long time) { go(Turn_left, time); }
  void turn_right(unsigned long time) { go(Turn_right, time); }
  void stop_motor() {
    status_ = Stop;
    timer_.cancel();
    if (driver_ != nullptr) driver_(Stop);
  }
  int current_status() const { return status_; }
  void update() {
    if (timer_.is_over(now())) stop_motor();
  }

 private:
  void go(Motor_status status, unsigned long time) {
    status_ = status;
    if (driver_ != nullptr) driver_(status);
    timer_.begin(now(), static_cast<uint32_t>(time));
  }
  uint32_t now() const { return clock_ == nullptr ? 0 : clock_(); }
  Timed_control timer_;
  Driver driver_ = nullptr;
  unsigned int (*clock_)() = nullptr;
  Motor_status status_ = Stop;
};

}  // namespace SwarmTalk
