#include "lab/interrupt.hpp"

#include <signal.h>

#include <stdexcept>

namespace swarmtalk::lab {
namespace {

volatile sig_atomic_t last_signal = 0;

void on_signal(int signal) {
  last_signal = signal;
}

}  // namespace

void remember_interrupts() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  sigemptyset(&action.sa_mask);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaction(signal, &action, nullptr);
}

int interrupted() {
  return last_signal;
}

void throw_if_interrupted() {
  if (last_signal != 0) throw std::runtime_error("interrupted; everything is taken down again");
}

}  // namespace swarmtalk::lab
