#include "daemon/common/patient_sink.hpp"

#include <poll.h>
#include <spdlog/details/log_msg.h>

#include <exception>
#include <string>

namespace swarmtalk::daemon {

bool PatientSink::takes_a_line() const {
  pollfd state{descriptor_, POLLOUT, 0};
  return poll(&state, 1, 0) == 1 && (state.revents & POLLOUT) != 0;
}

void PatientSink::log(const spdlog::details::log_msg& message) {
  if (!takes_a_line()) {
    ++lost_;
    ++untold_;
    return;
  }
  if (untold_ > 0) {
    const std::string text = std::to_string(untold_) + " log lines were lost: nobody read them";
    write({message.time, {}, message.logger_name, spdlog::level::warn, text});
    untold_ = 0;
    if (!takes_a_line()) return log(message);
  }
  write(message);
}

void PatientSink::write(const spdlog::details::log_msg& message) {
  spdlog::details::log_msg line = message;
  std::string cut;
  if (message.payload.size() > kLongestLineBytes) {
    cut.assign(message.payload.data(), kLongestLineBytes);
    while (!cut.empty() && (static_cast<unsigned char>(cut.back()) & 0x80) != 0) cut.pop_back();
    cut += "...";
    line.payload = cut;
  }
  inner_->log(line);
  inner_->flush();
}

}  // namespace swarmtalk::daemon
