#include <chrono>
#include <cstdio>

#include "cli/commands.hpp"
#include "cli/format.hpp"

namespace swarmtalk::cli {
namespace {

/// Prints one line. @return false when nobody reads any more
bool print_line(const std::string& line) {
  return std::fputs(line.c_str(), stdout) >= 0 && std::fputc('\n', stdout) != EOF &&
         std::fflush(stdout) == 0;
}

}  // namespace

int sub(const Common& common, const SubArguments& arguments) {
  Client client = make_client(common);
  if (const Status status = client.connect(); !status) return fail(status);
  stop_on_signals(client);
  client.on_disconnect([](const Status& status) { fail(status.text()); });
  client.on_reconnect([] { fail("connected to swarmtalkd again"); });
  client.on_error([](const Status& status) { fail(status.text()); });

  ChannelOptions options;
  if (arguments.is_timestamped) options.timestamped = true;
  std::uint64_t heard = 0;
  bool is_enough = false;
  bool is_reader_gone = false;
  std::vector<Subscriber> subscribers;
  for (const std::string& channel : arguments.channels) {
    const auto receive = [&, channel](const Message& message) {
      if (is_enough) return;
      ++heard;
      is_reader_gone = !print_line(common.is_json ? to_json(channel, message).dump()
                                                  : to_line(channel, message));
      is_enough = is_reader_gone || (arguments.count != 0 && heard == arguments.count);
      if (is_enough) client.stop();
    };
    subscribers.push_back(
        open_channel(client, channel, options).subscriber(receive, arguments.options));
    if (const Status status = subscribers.back().status(); !status) return fail(status);
  }

  if (arguments.timeout_s > 0) {
    client.run_for(std::chrono::duration_cast<std::chrono::nanoseconds>(
        std::chrono::duration<double>(arguments.timeout_s)));
  } else {
    client.run();
  }
  if (caught_signal() != 0) return kExitSignal + caught_signal();
  if (is_reader_gone) return kExitFailure;
  if (!is_enough && arguments.count != 0) {
    return fail("heard " + std::to_string(heard) + " of " + std::to_string(arguments.count) +
                    " messages within the time of -W",
                kExitTimeout);
  }
  return kExitOk;
}

}  // namespace swarmtalk::cli
