#include "lab/interrupt.hpp"

#include <signal.h>

#include <stdexcept>

#include "usage/ending_signals.hpp"

namespace swarmtalk::lab {
namespace {

volatile sig_atomic_t last_signal = 0;

void on_signal(int signal) {
  last_signal = signal;
}

}  // namespace

void remember_interrupts() {
  usage::catch_ending_signals(on_signal, 0);
}

int interrupted() {
  return last_signal;
}

void throw_if_interrupted() {
  if (last_signal != 0) throw std::runtime_error("interrupted; everything is taken down again");
}

}  // namespace swarmtalk::lab
