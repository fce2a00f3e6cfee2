#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>

#include "cli/commands.hpp"
#include "cli/hex.hpp"

namespace swarmtalk::cli {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::size_t kStdinMax = 64 * 1024;  // longer than any message

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

Clock::duration seconds(double value) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(value));
}

/// Runs the client until `holds`, a signal or the deadline. @return `holds()`
template <typename Condition>
bool run_until(Client& client, Clock::time_point deadline, Condition holds) {
  while (!holds() && caught_signal() == 0 && Clock::now() < deadline) {
    client.run_once(deadline - Clock::now());
  }
  return holds();
}

}  // namespace

int pub(const Common& common, const PubArguments& arguments) {
  std::string payload = arguments.payload;
  if (payload == "-") {
    const auto bytes = read_stdin();
    if (!bytes) return fail(std::string("cannot read standard input: ") + std::strerror(errno));
    payload = *bytes;
  }
  if (arguments.is_hex) {
    const auto bytes = from_hex(payload);
    if (!bytes) return fail("DATA is not hexadecimal: pairs of digits, as in 48:65:6c", kExitUsage);
    payload = *bytes;
  }

  Client client = make_client(common);
  if (const Status status = client.connect(); !status) return fail(status);
  stop_on_signals(client);
  ChannelOptions options;
  options.ttl = arguments.ttl;
  if (arguments.is_timestamped) options.timestamped = true;
  std::optional<Status> sent;
  auto publisher =
      open_channel(client, arguments.channel, options).publisher([&](const Status& status) {
        sent = status;
      });
  if (const Status status = publisher.status(); !status) return fail(status);

  auto next = Clock::now();
  for (std::uint64_t i = 0; arguments.repeat == 0 || i < arguments.repeat; ++i) {
    run_until(client, next, [] { return false; });
    if (caught_signal() != 0) break;
    sent.reset();
    if (const Status status = publisher.send(payload); !status) return fail(status);
    const auto deadline = Clock::now() + seconds(arguments.timeout_s);
    if (!run_until(client, deadline, [&] { return sent.has_value(); })) {
      if (caught_signal() != 0) break;
      return fail("the message has not left within the time of -W; see swarmtalk-cli status",
                  kExitTimeout);
    }
    if (!*sent) return fail(*sent);
    if (arguments.rate_hz > 0) next += seconds(1 / arguments.rate_hz);
  }
  return caught_signal() == 0 ? kExitOk : kExitSignal + caught_signal();
}

}  // namespace swarmtalk::cli
