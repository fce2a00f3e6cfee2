#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>

#include "cli/common/commands.hpp"
#include "cli/common/deadline.hpp"
#include "cli/common/link_watch.hpp"
#include "cli/common/quiet_watch.hpp"
#include "cli/text/format.hpp"
#include "text/counted.hpp"

namespace swarmtalk::cli {
namespace {

/// Waits until the client has work, or `deadline`. @return false when nobody reads our output
bool wait_for_work(const Client& client, Clock::time_point deadline) {
  using std::chrono::milliseconds;
  const auto left = std::chrono::ceil<milliseconds>(deadline - Clock::now());
  const auto wait = std::clamp<milliseconds>(left, milliseconds(0), std::chrono::hours(1));
  pollfd descriptors[] = {{client.fd(), POLLIN, 0}, {STDOUT_FILENO, 0, 0}};
  const int count = ::poll(descriptors, 2, static_cast<int>(wait.count()));
  return count <= 0 || (descriptors[1].revents & POLLERR) == 0;
}

/// Ends as a write into the pipe would end: by SIGPIPE unless that is ignored.
int end_without_reader() {
  ::raise(SIGPIPE);
  return kExitFailure;
}

}  // namespace

int sub(const Common& common, const SubArguments& arguments) {
  std::string problem;
  const auto text = MessageText::make(arguments.look, problem);
  if (!text) return fail(problem, kExitUsage);
  if (arguments.is_all) return sub_all(common, arguments, *text);
  Client client = make_client(common);
  if (const Status status = client.connect(); !status) return fail(status);
  stop_on_signals(client);
  tell_connection(client);
  client.on_error([](const Status& status) {
    if (status.code() != StatusCode::kLinkDown) fail(status.text());  // LinkWatch tells that
  });

  Policy policy = arguments.policy;
  if (arguments.max_age_s > 0) {
    policy.max_age = std::chrono::ceil<std::chrono::milliseconds>(seconds(arguments.max_age_s));
  }
  ChannelOptions options;
  if (arguments.is_timestamped) options.timestamped = true;
  std::uint64_t heard = 0;
  Loss lost;
  bool is_enough = false;
  int written = kExitOk;
  std::vector<Subscriber> subscribers;
  if (const std::string hint = wildcard_hint(arguments.channels); !hint.empty()) fail(hint);
  QuietWatch quiet(client, arguments.channels);
  const Look look = look_of_output();
  for (const std::string& channel : arguments.channels) {
    const auto receive = [&, channel](const Message& message) {
      if (is_enough) return;
      quiet.heard(channel);
      ++heard;
      lost += message.lost_before;
      const auto own_line = text->line(channel, message, common.is_json);
      const bool is_plain = !arguments.look.pattern.empty();
      if (own_line) written = is_plain ? print_as_is(*own_line + "\n") : print(*own_line + "\n");
      if (!own_line)
        written = print(
            (common.is_json ? to_json(channel, message).dump() : to_line(channel, message, look)) +
            "\n");
      is_enough = written != kExitOk || (arguments.count != 0 && heard == arguments.count);
    };
    Subscriber subscriber = open_channel(client, channel, options).subscriber(receive, policy);
    if (const Status status = subscriber.status(); !status) return fail(status);
    if (is_new(subscriber, subscribers)) subscribers.push_back(std::move(subscriber));
  }

  LinkWatch links(client);
  const auto deadline = arguments.timeout_s > 0 ? after(Clock::now(), seconds(arguments.timeout_s))
                                                : Clock::time_point::max();
  while (!is_enough && caught_signal() == 0 && Clock::now() < deadline) {
    links.look();
    if (links.has_told()) quiet.stop();
    quiet.look();
    if (!wait_for_work(client, std::min({deadline, links.next(), quiet.next()})))
      return end_without_reader();
    client.process();
  }
  if (lost) fail("heard " + text::counted(heard, "message") + ", lost " + loss_text(lost));
  if (caught_signal() != 0) return kExitSignal + caught_signal();
  if (written != kExitOk) return written;
  if (!is_enough && arguments.count != 0) {
    return fail("heard " + std::to_string(heard) + " of " + std::to_string(arguments.count) +
                    " messages within the time of -W",
                kExitTimeout);
  }
  return kExitOk;
}

}  // namespace swarmtalk::cli
