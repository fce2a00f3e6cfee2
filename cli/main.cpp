// swarmtalk-cli: publish, listen and look from the command line.
#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <string>

#include "cli/commands.hpp"

namespace swarmtalk::cli {
namespace {

constexpr const char* kFooter = R"(Channels: a name, or a number (digits only).
The socket is --socket PATH, else $SWARMTALK_SOCKET, else /run/swarmtalk/swarmtalkd.sock.
Exit codes: 0 done; 1 refused or failed; 2 wrong usage; 3 the daemon cannot be reached; 124 a
timeout (-W) came first; 128+N ended by signal N.)";

volatile std::sig_atomic_t signal_number = 0;
Client* signal_client = nullptr;

void on_signal(int number) {
  signal_number = number;
  signal_client->stop();
}

/// Above 0; CLI11's own check prints the largest double there is.
CLI::Validator above_zero() {
  const auto check = [](const std::string& word) {
    double value = 0;
    const bool is_good = CLI::detail::lexical_cast(word, value) && value > 0;
    return is_good ? std::string() : "must be a number above 0, not " + word;
  };
  return CLI::Validator(check, "");
}

void add_pub(CLI::App& app, PubArguments& arguments) {
  auto* command = app.add_subcommand("pub", "Publish one message and wait until it has left");
  command->add_option("CHANNEL", arguments.channel)->required();
  command->add_option("DATA", arguments.payload, "the message; - reads it from standard input")
      ->required();
  command->add_flag("--hex", arguments.is_hex, "DATA is hexadecimal, as in 48:65:6c or 48656c");
  command->add_option("--repeat", arguments.repeat, "how often; 0: until a signal")
      ->capture_default_str();
  command->add_option("--rate", arguments.rate_hz, "messages per second; default: as they leave")
      ->check(above_zero());
  command->add_option("--ttl", arguments.ttl, "hops after the first; default: 0");
  command->add_flag("--timestamped", arguments.is_timestamped, "carry the buffering delay");
  command->add_option("-W,--timeout", arguments.timeout_s, "seconds to wait for each to leave")
      ->check(above_zero())
      ->capture_default_str();
}

void add_sub(CLI::App& app, SubArguments& arguments, Common& common) {
  auto* command = app.add_subcommand("sub", "Print what is heard on one or more channels");
  command->add_option("CHANNEL", arguments.channels)->required();
  command->add_flag("--json", common.is_json, "one JSON object a line, SI units, null if unknown");
  command->add_option("-C,--count", arguments.count, "end after so many messages")
      ->check(above_zero());
  command
      ->add_option("-W,--timeout", arguments.timeout_s,
                   "end after so many seconds; exit code 124 when -C was not reached")
      ->check(above_zero());
  command->add_option("--max-distance", arguments.options.max_distance_m, "metres");
  command->add_flag("--drop-unknown-distance", arguments.options.drop_unknown_distance,
                    "with --max-distance: also leave out what has no distance");
  command->add_option("--keep-last", arguments.options.keep_last,
                      "messages the daemon queues for us; 1: only the newest");
  command->add_flag("--timestamped", arguments.is_timestamped, "register it as timestamped");
}

struct Parsed {
  Common common;
  PubArguments pub;
  SubArguments sub;
  PoseArguments pose;
};

void add_pose(CLI::App& app, Parsed& parsed) {
  auto* command = app.add_subcommand("pose", "Tell or ask where this robot is");
  command->require_subcommand(1);
  auto* set = command->add_subcommand("set", "Tell the daemon where this robot is");
  set->add_option("X", parsed.pose.x_m, "metres")->required();
  set->add_option("Y", parsed.pose.y_m, "metres")->required();
  set->add_option("THETA", parsed.pose.theta,
                  "counter-clockwise from +x: radians, or degrees as in 90deg")
      ->required();
  auto* get = command->add_subcommand("get", "Print the pose that the daemon has");
  get->add_flag("--json", parsed.common.is_json);
}

int run(CLI::App& app, const Parsed& parsed) {
  if (app.got_subcommand("pub")) return pub(parsed.common, parsed.pub);
  if (app.got_subcommand("sub")) return sub(parsed.common, parsed.sub);
  if (app.got_subcommand("status")) return status(parsed.common);
  if (app.get_subcommand("pose")->got_subcommand("set")) {
    return set_pose(parsed.common, parsed.pose);
  }
  return get_pose(parsed.common);
}

}  // namespace

int fail(std::string_view text, int exit_code) {
  std::fflush(stdout);
  std::fprintf(stderr, "swarmtalk-cli: %.*s\n", static_cast<int>(text.size()), text.data());
  return exit_code;
}

int fail(const Status& status) {
  switch (status.code()) {
    case StatusCode::kNoDaemon:
    case StatusCode::kDaemonDead:
    case StatusCode::kNoPermission:
    case StatusCode::kVersionMismatch:
    case StatusCode::kDisconnected:
      return fail(status.text(), kExitNoDaemon);
    case StatusCode::kTimeout:
      return fail(status.text(), kExitTimeout);
    default:
      return fail(status.text());
  }
}

Client make_client(const Common& common) {
  ClientOptions options;
  options.socket_path = common.socket_path;
  Client client("swarmtalk-cli", options);
  client.on_error({});
  client.on_disconnect({});
  client.on_reconnect({});
  return client;
}

Channel open_channel(Client& client, const std::string& word, const ChannelOptions& options) {
  const bool is_number = !word.empty() && word.size() <= 9 &&
                         word.find_first_not_of("0123456789") == std::string::npos;
  return is_number ? client.channel(std::stoi(word), options) : client.channel(word, options);
}

void stop_on_signals(Client& client) {
  signal_client = &client;
  struct sigaction action {};
  action.sa_handler = on_signal;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

int caught_signal() {
  return signal_number;
}

}  // namespace swarmtalk::cli

int main(int argc, char** argv) {
  using namespace swarmtalk::cli;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);  // a line is out at once, into a pipe too
  Parsed parsed;
  CLI::App app("Publish, listen and look: the command line of swarmtalkd", "swarmtalk-cli");
  app.footer(kFooter);
  app.require_subcommand(1);
  app.set_version_flag("--version", SWARMTALK_VERSION);
  app.add_option("--socket", parsed.common.socket_path, "the daemon's socket");
  app.fallthrough();
  add_pub(app, parsed.pub);
  add_sub(app, parsed.sub, parsed.common);
  app.add_subcommand("status", "Print the daemon's links, channels and counters")
      ->add_flag("--json", parsed.common.is_json, "one JSON object");
  add_pose(app, parsed);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& call) {
    return app.exit(call);
  } catch (const CLI::CallForVersion& call) {
    return app.exit(call);
  } catch (const CLI::ParseError& error) {
    return fail(std::string(error.what()) + "; see swarmtalk-cli --help", kExitUsage);
  }
  try {
    return run(app, parsed);
  } catch (const std::exception& error) {
    return fail(error.what());
  }
}
