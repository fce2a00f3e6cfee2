#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "cli/commands.hpp"
#include "cli/deadline.hpp"
#include "cli/hex.hpp"

namespace swarmtalk::cli {
namespace {

constexpr std::size_t kStdinMax = 256 * 1024;  // longer than any message, also in hexadecimal
constexpr std::chrono::milliseconds kRetryPause{100};

/// All of standard input, at most kStdinMax + 1 bytes; nullopt on a read error.
std::optional<std::string> read_stdin() {
  std::string bytes;
  char buffer[4096];
  while (bytes.size() <= kStdinMax) {
    const ssize_t count = ::read(STDIN_FILENO, buffer, sizeof(buffer));
    if (count == 0) break;
    if (count > 0) {
      bytes.append(buffer, static_cast<std::size_t>(count));
    } else if (errno != EINTR) {
      return std::nullopt;
    }
  }
  return bytes;
}

/// Whether the next message may well leave, though this one has not.
bool is_interruption(const Status& status) {
  switch (status.code()) {
    case StatusCode::kBusy:  // the one before has timed out and is still on its way
    case StatusCode::kTimeout:
    case StatusCode::kDisconnected:
    case StatusCode::kLinkDown:
    case StatusCode::kLimit:
      return true;
    default:
      return false;
  }
}

/// Sends the messages of one command, one after the other.
class Sender {
 public:
  Sender(Client& client, const PubArguments& arguments) : client_(client), arguments_(arguments) {
    ChannelOptions options;
    options.ttl = arguments.ttl;
    if (arguments.is_timestamped) options.timestamped = true;
    publisher_ = open_channel(client, arguments.channel, options)
                     .publisher([this](const Status& status) { sent_ = status; },
                                Sending::one_at_a_time().repeated(arguments.copies));
  }

  const Publisher& publisher() const { return publisher_; }

  /// Until all have left, a signal, or a failure. @return the exit code
  int send_all(const std::string& payload) {
    auto next = Clock::now();
    for (std::uint64_t i = 0; arguments_.repeat == 0 || i < arguments_.repeat; ++i) {
      run_until(next, [] { return false; });
      if (caught_signal() != 0) break;
      const Status status = send(payload);
      if (caught_signal() != 0) break;
      if (!status && (arguments_.repeat != 0 || !is_interruption(status))) return fail(status);
      tell(status);
      if (arguments_.rate_hz > 0) next = after(next, seconds(1 / arguments_.rate_hz));
      const auto now = Clock::now();
      if (!status) next = std::max(next, now + kRetryPause);
      if (now - next > std::chrono::seconds(1)) next = now;  // do not catch up in a burst
    }
    return caught_signal() == 0 ? kExitOk : kExitSignal + caught_signal();
  }

 private:
  /// Runs the client until `holds`, a signal or the deadline. @return `holds()`
  template <typename Condition>
  bool run_until(Clock::time_point deadline, Condition holds) {
    while (!holds() && caught_signal() == 0 && Clock::now() < deadline) {
      client_.run_once(deadline - Clock::now());
    }
    return holds();
  }

  /// One message, until it has left.
  Status send(const std::string& payload) {
    sent_.reset();
    if (const Status status = publisher_.send(payload); !status) return status;
    const auto deadline = after(Clock::now(), seconds(arguments_.timeout_s));
    if (run_until(deadline, [this] { return sent_.has_value(); })) return *sent_;
    return Status(StatusCode::kTimeout,
                  "the message has not left within the time of -W; see swarmtalk-cli status");
  }

  /// Once when messages no longer leave, once when they do again. A lost daemon tells of itself.
  void tell(const Status& status) {
    if (status.code() == StatusCode::kDisconnected) return;
    if (!status && !is_interrupted_) fail(status.text());
    if (status && is_interrupted_) fail("messages leave again");
    is_interrupted_ = !status;
  }

  Client& client_;
  const PubArguments& arguments_;
  std::optional<Status> sent_;
  Publisher publisher_;
  bool is_interrupted_ = false;
};

}  // namespace

int pub(const Common& common, const PubArguments& arguments) {
  std::string payload = arguments.payload;
  bool is_cut = false;
  if (payload == "-") {
    const auto bytes = read_stdin();
    if (!bytes) return fail(std::string("cannot read standard input: ") + std::strerror(errno));
    payload = *bytes;
    is_cut = payload.size() > kStdinMax;
  }
  if (arguments.is_hex && !is_cut) {
    const auto bytes = from_hex(payload);
    if (!bytes) return fail("DATA is not hexadecimal: pairs of digits, as in 48:65:6c", kExitUsage);
    payload = *bytes;
  }

  Client client = make_client(common);
  if (const Status status = client.connect(); !status) return fail(status);
  stop_on_signals(client);
  if (arguments.repeat == 0) tell_connection(client);
  Sender sender(client, arguments);
  if (const Status status = sender.publisher().status(); !status) return fail(status);
  if (is_cut) {
    return fail("standard input has more than " + std::to_string(kStdinMax) + " bytes; channel " +
                arguments.channel + " carries at most " +
                std::to_string(sender.publisher().max_message_bytes()));
  }
  return sender.send_all(payload);
}

}  // namespace swarmtalk::cli
