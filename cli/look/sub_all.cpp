// `swarmtalk-cli sub --all`: as sub, of every channel here and on the air.
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <vector>

#include "cli/common/commands.hpp"
#include "cli/common/link_watch.hpp"
#include "cli/look/all_channels.hpp"
#include "cli/text/format.hpp"
#include "text/counted.hpp"

namespace swarmtalk::cli {

int sub_all(const Common& common, const SubArguments& arguments, const MessageText& text) {
  Client client = make_client(common);
  if (const Status status = client.connect(); !status) return fail(status);
  stop_on_signals(client);
  tell_connection(client);
  client.on_error({});  // AllChannels tells what is refused, LinkWatch that links are down
  Policy policy = arguments.policy;
  if (arguments.max_age_s > 0) {
    policy.max_age = std::chrono::ceil<std::chrono::milliseconds>(seconds(arguments.max_age_s));
  }
  std::uint64_t heard = 0;
  Loss lost;
  int written = kExitOk;
  const auto is_enough = [&] {
    return written != kExitOk || (arguments.count != 0 && heard == arguments.count);
  };
  const auto receive = [&](const std::string& channel, const Message& message) {
    if (is_enough()) return;
    ++heard;
    lost += message.lost_before;
    const auto line = text.line(channel, message, common.is_json);
    if (line && !arguments.look.pattern.empty()) {  // plain but for what the pattern itself holds
      written = print_as_is(*line + "\n");
      return;
    }
    written = print((line             ? *line
                     : common.is_json ? to_json(channel, message).dump()
                                      : to_line(channel, message)) +
                    "\n");
  };
  AllChannels all(client, common.socket_path, policy, receive);
  if (const Status status = all.start(); !status) return fail(status);
  LinkWatch links(client);
  const auto end = arguments.timeout_s > 0 ? after(Clock::now(), seconds(arguments.timeout_s))
                                           : Clock::time_point::max();
  while (!is_enough() && caught_signal() == 0 && Clock::now() < end) {
    links.look();
    all.look();
    const auto next = std::min({end, links.next(), all.next()});
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(next - Clock::now()).count();
    std::vector<pollfd> descriptors{{STDOUT_FILENO, 0, 0}, {client.fd(), POLLIN, 0}};
    for (const int fd : all.fds()) descriptors.push_back({fd, POLLIN, 0});
    ::poll(descriptors.data(), descriptors.size(),
           static_cast<int>(std::clamp<std::int64_t>(left, 0, 3'600'000)));
    if ((descriptors[0].revents & POLLERR) != 0) {
      ::raise(SIGPIPE);  // as a write into the pipe would end
      return kExitFailure;
    }
    client.process();
  }
  if (const std::string left_out = all.left_out_text(); !left_out.empty()) fail(left_out);
  if (lost) fail("heard " + text::counted(heard, "message") + ", lost " + loss_text(lost));
  if (caught_signal() != 0) return kExitSignal + caught_signal();
  if (written != kExitOk) return written;
  if (!is_enough() && arguments.count != 0) {
    return fail("heard " + std::to_string(heard) + " of " + std::to_string(arguments.count) +
                    " messages within the time of -W",
                kExitTimeout);
  }
  return kExitOk;
}

}  // namespace swarmtalk::cli
