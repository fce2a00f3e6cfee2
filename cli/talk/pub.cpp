#include <poll.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "cli/common/commands.hpp"
#include "cli/common/deadline.hpp"
#include "cli/common/quiet_watch.hpp"
#include "cli/talk/pub_input.hpp"

namespace swarmtalk::cli {
namespace {

constexpr std::chrono::milliseconds kRetryPause{100};

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
    Sending sending = Sending::one_at_a_time().repeated(arguments.copies);
    if (!arguments.redundancy.empty()) {
      const bool is_auto = arguments.redundancy == "auto";
      sending =
          sending.redundant(is_auto ? Sending::kAutoRedundancy
                                    : static_cast<std::uint32_t>(std::stoul(arguments.redundancy)));
    }
    publisher_ = open_channel(client, arguments.channel, options)
                     .publisher([this](const Status& status) { sent_ = status; }, sending);
  }

  const Publisher& publisher() const { return publisher_; }

  /// Something else has said why perhaps nobody gets what is published.
  void stop_looking() { has_looked_ = true; }

  /// The one message so often as asked, until all have left, a signal, or a failure.
  /// @return the exit code
  int send_all(const std::string& payload) {
    for (std::uint64_t i = 0; arguments_.repeat == 0 || i < arguments_.repeat; ++i) {
      const int exit_code = send_in_turn(payload);
      if (caught_signal() != 0) break;
      if (exit_code != kExitOk) return exit_code;
    }
    return caught_signal() == 0 ? kExitOk : kExitSignal + caught_signal();
  }

  /// Each line until the end of them. @return as send_all()
  int send_lines(PubInput& input) {
    std::string payload;
    while (caught_signal() == 0) {
      const PubInput::State state = input.next_line(payload);
      if (state == PubInput::State::kEnd) return kExitOk;
      if (state == PubInput::State::kBad) return fail(input.problem());
      if (state == PubInput::State::kWait) {
        wait_for(input);
        continue;
      }
      const int exit_code = send_in_turn(payload, &input);
      if (exit_code != kExitOk && caught_signal() == 0) return exit_code;
    }
    return kExitSignal + caught_signal();
  }

 private:
  /// Waits for its time, and until it has left.
  /// @param lines  where the payload is from, if it is one of them
  /// @return the exit code of a failure
  int send_in_turn(const std::string& payload, const PubInput* lines = nullptr) {
    run_until(next_, [] { return false; });
    if (caught_signal() != 0) return kExitOk;
    const Status status = send(payload);
    if (caught_signal() != 0) return kExitOk;
    if (!status && (arguments_.repeat != 0 || !is_interruption(status))) {
      if (lines == nullptr) return fail(status);
      const bool is_lost = status.code() == StatusCode::kDisconnected;
      const auto why = is_lost ? "swarmtalkd is gone" : status.text();
      return fail(Status(status.code(), lines->not_sent(why)));
    }
    tell(status);
    if (status && !std::exchange(has_looked_, true)) look_for_others();
    if (arguments_.rate_hz > 0) next_ = after(next_, seconds(1 / arguments_.rate_hz));
    const auto now = Clock::now();
    if (!status) next_ = std::max(next_, now + kRetryPause);
    if (now - next_ > std::chrono::seconds(1)) next_ = now;  // do not catch up in a burst
    return kExitOk;
  }

  /// Reads when there is something; the client goes on meanwhile.
  void wait_for(PubInput& input) {
    pollfd descriptors[] = {{client_.fd(), POLLIN, 0}, {input.fd(), POLLIN, 0}};
    ::poll(descriptors, 2, -1);
    if (caught_signal() != 0) return;
    if (descriptors[1].revents != 0) input.read();
    client_.process();
  }

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

  void look_for_others() {
    DaemonStatus daemon;
    std::vector<Neighbour> neighbours;
    if (!client_.get_status(daemon) || !client_.get_neighbours(neighbours)) return;
    const std::string nobody = unheard_text(arguments_.channel, daemon, neighbours);
    if (!nobody.empty()) fail(nobody);
  }

  Client& client_;
  const PubArguments& arguments_;
  std::optional<Status> sent_;
  Publisher publisher_;
  bool is_interrupted_ = false;
  bool has_looked_ = false;
  Clock::time_point next_ = Clock::now();
};

}  // namespace

int pub(const Common& common, const PubArguments& arguments) {
  if (arguments.is_lines && arguments.repeat != 1) {
    return fail("--lines sends each line once, so --repeat cannot go with it", kExitUsage);
  }
  PubInput input;
  if (const std::string problem = input.open(arguments); !problem.empty()) {
    return fail(problem, input.exit_code());
  }

  Client client = make_client(common);
  if (const Status status = client.connect(); !status) return fail(status);
  stop_on_signals(client);
  if (arguments.repeat == 0) tell_connection(client);
  Sender sender(client, arguments);
  if (const Status status = sender.publisher().status(); !status) return fail(status);
  DaemonStatus daemon;
  if (client.get_status(daemon)) {
    const std::string hint = misspelt_text(arguments.channel, daemon);
    if (!hint.empty()) fail(hint);  // it may be a channel of other robots: it is sent all the same
    if (!hint.empty()) sender.stop_looking();
  }
  if (!arguments.redundancy.empty() && !sender.publisher().has_redundancy()) {
    fail("messages leave without repair packets: no link of channel " + arguments.channel +
         " has profile \"wifi\", or swarmtalkd is an older one; use --copies");
  }
  if (input.is_cut()) {
    return fail((arguments.file.empty() ? "standard input" : arguments.file) + " has more than " +
                std::to_string(PubInput::kMaxBytes) + " bytes; channel " + arguments.channel +
                " carries at most " + std::to_string(sender.publisher().max_message_bytes()));
  }
  return arguments.is_lines ? sender.send_lines(input) : sender.send_all(input.payload());
}

}  // namespace swarmtalk::cli
