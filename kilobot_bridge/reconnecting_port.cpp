#include "kilobot_bridge/reconnecting_port.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "drivers/link/link_log.hpp"

namespace swarmtalk::kilobot_bridge {
namespace {

constexpr int kReadsPerTurn = 16;
constexpr std::size_t kReadBytes = 1024;

}  // namespace

ReconnectingPort::ReconnectingPort(boost::asio::io_context& io, PortConfig config, PortUser& user)
    : config_(std::move(config)),
      user_(user),
      watched_(loop::Loop::of(io), [this](std::uint32_t) { on_readable(); }),
      retry_timer_(io, [this] { attempt(); }),
      failing_(loop::Loop::of(io), [this] { fail(std::strerror(error_)); }) {
  const OpenProblem problem = device_.open(config_.path, config_.baud);
  // At once: with the privileges of the start more of them are seen.
  if (problem.kind == OpenProblem::Kind::kNone) {
    look_for_others();
    return;
  }
  problem_ = problem.text;
  if (problem.kind == OpenProblem::Kind::kAbsent) return;
  throw std::runtime_error("serial device '" + config_.path + "': " + problem.text);
}

void ReconnectingPort::start() {
  if (device_.is_open()) return on_open();
  drivers::link_log()->warn("serial device '{}': {} Waiting for it", config_.path, problem_);
  schedule_attempt();
}

std::size_t ReconnectingPort::write(std::span<const std::uint8_t> bytes) {
  if (!device_.is_open() || is_failing_) return 0;
  const std::ptrdiff_t count = device_.write(bytes);
  if (count >= 0) return static_cast<std::size_t>(count);
  fail_later(errno);
  return 0;
}

void ReconnectingPort::fail(const std::string& reason) {
  if (!device_.is_open()) return;
  is_failing_ = false;
  watched_.close();
  device_.discard_output();
  device_.close();
  ++losses_;
  attempts_ = 0;
  problem_ = reason;
  drivers::link_log()->warn("serial device '{}' is lost: {}. Opening it again", config_.path,
                            reason);
  user_.on_port_lost(*this);
  schedule_attempt();
}

// Whoever opened it before us keeps it, if it takes no lock.
void ReconnectingPort::look_for_others() {
  others_ = serial::other_holders(config_.path).seen;
  if (others_.empty()) return;
  drivers::link_log()->warn(
      "serial device '{}' is open in another program too: {}. What that reads is lost here; end it",
      config_.path, serial::text_of(others_));
}

std::string ReconnectingPort::others() const {
  std::vector<serial::Holder> left;
  std::copy_if(others_.begin(), others_.end(), std::back_inserter(left),
               [this](const auto& each) { return serial::still_holds(each, config_.path); });
  return serial::text_of(left);
}

void ReconnectingPort::on_open() {
  problem_.clear();
  attempts_ = 0;
  const int duplicate = ::fcntl(device_.descriptor(), F_DUPFD_CLOEXEC, 0);
  if (duplicate < 0) throw std::runtime_error(std::string("serial device: ") + strerror(errno));
  watched_.own(duplicate);
  user_.on_port_open(*this);
  if (device_.is_open()) watched_.watch(EPOLLIN);
}

void ReconnectingPort::on_readable() {
  std::array<std::uint8_t, kReadBytes> bytes;
  for (int i = 0; i < kReadsPerTurn && device_.is_open(); ++i) {
    const std::ptrdiff_t count = device_.read(bytes);
    if (count < 0) return fail(std::strerror(errno));
    if (count == 0) break;
    user_.on_port_bytes(
        *this, std::span<const std::uint8_t>(bytes).first(static_cast<std::size_t>(count)));
  }
}

// Not at once: the caller is in the middle of something that on_port_lost() would undo.
void ReconnectingPort::fail_later(int error) {
  if (std::exchange(is_failing_, true)) return;
  error_ = error;
  failing_.at_end();
}

void ReconnectingPort::schedule_attempt() {
  const std::size_t last = config_.pauses.size() - 1;
  retry_timer_.after(config_.pauses[std::min(attempts_, last)]);
}

void ReconnectingPort::attempt() {
  ++attempts_;
  const OpenProblem problem = device_.open(config_.path, config_.baud);
  if (problem.kind == OpenProblem::Kind::kNone) {
    drivers::link_log()->info("serial device '{}' is open", config_.path);
    look_for_others();
    return on_open();
  }
  if (problem.text != problem_ && problem.kind != OpenProblem::Kind::kAbsent) {
    drivers::link_log()->warn("serial device '{}': {}", config_.path, problem.text);
  }
  problem_ = problem.text;
  schedule_attempt();
}

}  // namespace swarmtalk::kilobot_bridge
