// swarmtalk-cli: publish, listen and look from the command line.
#include <CLI/CLI.hpp>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <optional>
#include <string>

#include "cli/common/checks.hpp"
#include "cli/common/commands.hpp"
#include "cli/common/looking.hpp"
#include "cli/doctor/doctor.hpp"
#include "cli/doctor/survey.hpp"
#include "cli/kilobot/kilobot.hpp"
#include "cli/recording/recording.hpp"
#include "cli/text/table.hpp"
#include "text/plain.hpp"
#include "usage/ending_signals.hpp"
#include "usage/mistakes.hpp"
#include "usage/usage.hpp"

namespace swarmtalk::cli {
namespace {

constexpr const char* kFooter = R"(Channels: a name, or a number from 0 to 65535 (digits only).
The socket is --socket PATH, else $SWARMTALK_SOCKET, else /run/swarmtalk/swarmtalkd.sock.
Exit codes: 0 done; 1 refused or failed; 2 wrong usage; 3 the daemon cannot be reached; )"
                                "124 a timeout (-W) came first; 128+N ended by signal N.";

volatile std::sig_atomic_t signal_number = 0;
Client* signal_client = nullptr;

void on_signal(int number) {
  signal_number = number;
  if (signal_client != nullptr) signal_client->stop();
}

CLI::Validator redundancy() {
  const auto check = [](const std::string& word) {
    const bool is_number = is_digits(word) && word.size() <= 2;
    const int number = is_number ? std::stoi(word) : 0;
    const bool is_good = word == "auto" || (number >= 1 && number <= 12);
    return is_good ? std::string() : "redundancy is auto, or 1 to 12, not " + word;
  };
  return CLI::Validator(check, "");
}

/// What CLI11 does not say: what helps words to be DATA.
std::string hint(const CLI::App& app, const CLI::ParseError& error, int argc, char** argv) {
  // The name of an ExtrasError is the subcommand's.
  const bool is_extra = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError);
  if (error.get_name() != "RequiredError" && !is_extra) return {};
  bool has_dash = false;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--") == 0) return {};
    has_dash = has_dash || (argv[i][0] == '-' && std::strchr("-W", argv[i][1]) == nullptr);
  }
  const bool is_pub = app.got_subcommand("pub");
  if (is_pub && has_dash) return "; DATA that begins with - goes after --: pub CHANNEL -- DATA";
  return is_pub && is_extra ? "; put a message of several words in quotes" : "";
}

/// The help of what was meant: of `swarmtalk-cli kilobot`, if the words got so far.
std::string help_of(const CLI::App& app) {
  std::string words = "swarmtalk-cli";
  const CLI::App* command = &app;
  for (auto next = app.get_subcommands(); !next.empty(); next = command->get_subcommands()) {
    command = next.back();
    if (command->get_name() == "help") break;  // its words name what was meant
    words += " " + command->get_name();
  }
  return words + " --help";
}

void add_pub(CLI::App& app, PubArguments& arguments) {
  auto* command = app.add_subcommand("pub", "Publish one message and wait until it has left");
  command->add_option("CHANNEL", arguments.channel)->required()->check(channel());
  auto* payload = command->add_option(
      "DATA", arguments.payload,
      "the message; - reads it from standard input; -- goes before one that begins with -");
  auto* file = command->add_option("--file", arguments.file, "read it from this file");
  payload->excludes(file);
  auto* lines =
      command->add_flag("-l,--lines", arguments.is_lines,
                        "each line of standard input, or of --file, is a message, without "
                        "its LF or CR LF");
  payload->excludes(lines);
  command
      ->add_option("--fmt", arguments.struct_format,
                   "DATA, or each line, are values for this format; as for Python's struct: "
                   "--fmt \"<Hf\" \"7 2.5\"")
      ->check(not_empty());
  command->callback([&arguments, payload] {
    if (payload->count() == 0 && arguments.file.empty() && !arguments.is_lines) {
      throw CLI::RequiredError("DATA");
    }
  });
  command->add_flag("--hex", arguments.is_hex, "DATA is hexadecimal, as in 48:65:6c or 48656c");
  command
      ->add_option("--repeat", arguments.repeat,
                   "how many times; 0: until a signal, also while daemon or link are away")
      ->check(whole_number())
      ->capture_default_str();
  command->add_option("--rate", arguments.rate_hz, "messages per second; default: as they leave")
      ->check(above_zero());
  command->add_option("--ttl", arguments.ttl, "hops after the first; default: 0")->check(ttl());
  command
      ->add_option("--copies", arguments.copies,
                   "how many times to send each message; receivers get it once")
      ->check(whole_number(100, 1))
      ->capture_default_str();
  command
      ->add_option("--redundancy", arguments.redundancy,
                   "repair packets of each message, 1 to 12, or auto: as the loss around demands")
      ->check(redundancy());
  command->add_flag("--timestamped", arguments.is_timestamped, "carry the buffering delay");
  command->add_option("-W,--timeout", arguments.timeout_s, "seconds to wait for each to leave")
      ->check(above_zero())
      ->capture_default_str();
}

void add_sub(CLI::App& app, SubArguments& arguments, Common& common) {
  auto* command = app.add_subcommand("sub", "Print what is heard on one or more channels");
  auto* names = command->add_option("CHANNEL", arguments.channels)->check(channel());
  auto* all = command->add_flag("-a,--all", arguments.is_all,
                                "every channel, of programs here and on the air");
  all->excludes(names);
  command->callback([&arguments] {
    if (arguments.channels.empty() && !arguments.is_all) {
      throw CLI::RequiredError("CHANNEL, or --all,");
    }
  });
  auto* const pattern =
      command->add_option("-F,--format", arguments.look.pattern, MessageText::help())
          ->check(not_empty());
  command
      ->add_option("--fmt", arguments.look.struct_format,
                   "also the payload's numbers; as for Python's struct, \"<Hff\"")
      ->check(not_empty());
  command->add_flag("--time", arguments.look.has_time, "also when each was received, UTC")
      ->excludes(pattern);  // which has %I
  command->add_flag("--json", common.is_json, "one JSON object a line, SI units, null if unknown")
      ->excludes(pattern);  // which has %j
  command->add_option("-C,--count", arguments.count, "end after this many messages")
      ->check(count());
  command
      ->add_option("-W,--timeout", arguments.timeout_s,
                   "end after this many seconds; exit code 124 when -C was not reached")
      ->check(above_zero());
  command->add_option("--max-distance", arguments.policy.max_distance_m, "metres")
      ->check(between(0, 1e9));
  command->add_flag("--drop-unknown-distance", arguments.policy.drop_unknown_distance,
                    "leave out messages without a distance");
  command
      ->add_option("--keep-last", arguments.policy.keep_last,
                   "how many messages may wait; 1: only the newest")
      ->check(whole_number(UINT32_MAX, 1));
  command->add_flag("--latest-from-each", arguments.policy.latest_of_each,
                    "only the newest of each sender waits");
  command
      ->add_option("--max-age", arguments.max_age_s,
                   "seconds since the message was received; older ones are dropped and counted")
      ->check(above_zero());
  command->add_flag("--timestamped", arguments.is_timestamped, "register it as timestamped")
      ->excludes(all);  // as their packets are
}

struct LogArguments {
  std::optional<std::string> text;  // an empty line is one, too
  SubArguments listening;
};

/// Without a line to send: listens.
int log(const Common& common, LogArguments& arguments) {
  if (!arguments.text) {
    arguments.listening.channels = {"debug"};
    if (!common.is_json) arguments.listening.look.pattern = "%I  robot %s  %p";
    return sub(common, arguments.listening);
  }
  PubArguments line;
  line.channel = "debug";
  line.payload = *arguments.text;
  line.ttl = 4;
  return pub(common, line);
}

void add_reserved(CLI::App& app, LogArguments& log, HarvestArguments& harvest, Common& common) {
  auto* lines = app.add_subcommand(
      "log", "Print the log lines of all robots around, over a few hops; or send one");
  auto* const text =
      lines->add_option("TEXT", log.text, "the line to send; needs debug = true under [reserved]");
  lines->add_flag("--json", common.is_json, "one JSON object a line")->excludes(text);
  lines->add_option("-C,--count", log.listening.count, "end after this many lines")
      ->check(count())
      ->excludes(text);
  lines
      ->add_option("-W,--timeout", log.listening.timeout_s,
                   "end after this many seconds; exit code 124 when -C was not reached")
      ->check(above_zero());
  auto* values = app.add_subcommand(
      "harvest",
      "Print values that programs of all robots around have set; needs harvest = true under "
      "[reserved]");
  values->add_option("PREFIX", harvest.prefix, "of the keys; default: all");
  auto* const offer =
      values->add_option("--offer", harvest.values, "KEY=VALUE to answer with, until a signal");
  values->add_flag("--json", common.is_json, "one JSON object a value")->excludes(offer);
  values->add_option("--ttl", harvest.ttl, "hops after the first, there and back")
      ->check(ttl())
      ->capture_default_str();
  values->add_option("-W,--timeout", harvest.timeout_s, "seconds to wait for answers")
      ->check(above_zero())
      ->capture_default_str();
}

struct Parsed {
  Common common;
  LogArguments log;
  HarvestArguments harvest;
  PubArguments pub;
  SubArguments sub;
  PoseArguments pose;
  std::string key_file;
  KilobotArguments kilobot;
  LogLevelArguments log_level;
  std::string node_id;
  CaptureArguments capture;
  Verb verb;  // of a family with files of its own
};

void add_pose(CLI::App& app, Parsed& parsed) {
  auto* command = app.add_subcommand("pose", "Tell or ask where this robot is");
  command->require_subcommand(1);
  auto* set = command->add_subcommand(
      "set", "Tell the daemon where this robot is; true until a pose is set again");
  set->add_option("X", parsed.pose.x_m, "metres")->required()->check(any_number());
  set->add_option("Y", parsed.pose.y_m, "metres")->required()->check(any_number());
  set->add_option("THETA", parsed.pose.theta,
                  "counter-clockwise from +x: radians, or degrees as in 90deg")
      ->required();
  set->add_flag("--age-out", parsed.pose.is_ageing,
                "the pose ages, as one that a program keeps setting; default: it stays");
  auto* get = command->add_subcommand("get", "Print the pose that the daemon has");
  get->add_flag("--json", parsed.common.is_json);
}

/// "auto", or a number that a node id can be.
CLI::Validator node_id_word() {
  const auto check = [](const std::string& word) {
    const bool is_number = is_digits(word) && word.size() <= 5;
    const int number = is_number ? std::stoi(word) : 0;
    const bool is_good = word == "auto" || (number >= 1 && number <= 65534);
    return is_good ? std::string() : "a node id is auto, or 1 to 65534, not " + word;
  };
  return CLI::Validator(check, "");
}

void add_operation(CLI::App& app, Parsed& parsed) {
  app.add_subcommand("reload",
                     "Let the daemon read its configuration again; prints what applies now and "
                     "what needs a restart");
  auto* level = app.add_subcommand("log-level", "Print or set what the daemon writes to its log");
  level->add_option("LEVEL", parsed.log_level.level, "trace, debug, info, warning or error");
  level->add_option("SUBSYSTEM", parsed.log_level.subsystem,
                    "daemon, client, hub or link; default: all");
  app.add_subcommand("node-id", "Set this robot's node id until the daemon ends")
      ->add_option("ID", parsed.node_id, "auto, or 1 to 65534")
      ->required()
      ->check(node_id_word());
  app.add_subcommand("metrics", "Print the daemon's metrics as Prometheus text");
  auto* capture = app.add_subcommand(
      "capture", "Write every frame that the daemon's links receive or send to a pcap file");
  capture
      ->add_option("FILE", parsed.capture.file,
                   "the capture; FILE.dropped tells what was dropped, and why")
      ->type_name("FILE")
      ->required();
  capture->add_option("-C,--count", parsed.capture.count, "end after this many frames")
      ->check(count());
  capture
      ->add_option("--unseal", parsed.capture.key_file,
                   "key file of the swarm: frames sealed with it are written unsealed")
      ->type_name("FILE");
  auto* const from = capture
                         ->add_option("--from", parsed.capture.from,
                                      "copy a capture instead of listening; needs no daemon")
                         ->type_name("FILE");
  capture->add_flag("--replace", parsed.capture.replaces, "FILE may exist and is overwritten");
  capture
      ->add_option("-W,--timeout", parsed.capture.timeout_s,
                   "end after this many seconds; exit code 124 when -C was not reached")
      ->check(above_zero())
      ->excludes(from);
  auto* const keygen =
      app.add_subcommand("keygen", "Make a swarm key, which seals what links send");
  keygen->footer("Exit codes: 0 done; 1 refused or failed; 2 wrong usage.");
  keygen->add_option("FILE", parsed.key_file, "where to; it must not exist")
      ->type_name("FILE")
      ->required();
}

int run(CLI::App& app, Parsed& parsed) {
  if (parsed.verb) return parsed.verb();
  if (app.got_subcommand("pub")) return pub(parsed.common, parsed.pub);
  if (app.got_subcommand("sub")) return sub(parsed.common, parsed.sub);
  if (app.got_subcommand("log")) return log(parsed.common, parsed.log);
  if (app.got_subcommand("harvest")) return harvest(parsed.common, parsed.harvest);
  if (app.got_subcommand("neighbours")) return neighbours(parsed.common);
  if (app.got_subcommand("status")) return status(parsed.common);
  if (app.got_subcommand("reload")) return reload(parsed.common);
  if (app.got_subcommand("log-level")) return log_level(parsed.common, parsed.log_level);
  if (app.got_subcommand("node-id")) return node_id(parsed.common, parsed.node_id);
  if (app.got_subcommand("metrics")) return metrics(parsed.common);
  if (app.got_subcommand("capture")) return capture(parsed.common, parsed.capture);
  if (app.got_subcommand("keygen")) return keygen(parsed.key_file);
  if (app.got_subcommand("stats")) return stats(parsed.common);
  if (app.got_subcommand("kilobot")) return kilobot(parsed.common, parsed.kilobot);
  if (app.get_subcommand("pose")->got_subcommand("set")) {
    return set_pose(parsed.common, parsed.pose);
  }
  return get_pose(parsed.common);
}

}  // namespace

int fail(std::string_view text, int exit_code) {
  std::fflush(stdout);
  std::fprintf(stderr, "swarmtalk-cli: %s\n", text::plain(text).c_str());
  return exit_code;
}

int fail_of_screen(const Status& status) {
  if (status.code() != StatusCode::kDisconnected) return fail(status);
  return fail("swarmtalkd closed the connection", kExitNoDaemon);
}

/// Who ends does not reconnect.
static std::string_view without_promise(std::string_view text) {
  constexpr std::string_view kPromise = "; reconnecting";
  return text.substr(0, text.size() - (text.ends_with(kPromise) ? kPromise.size() : 0));
}

int fail(const Status& status) {
  switch (status.code()) {
    case StatusCode::kNoDaemon:
    case StatusCode::kDaemonDead:
    case StatusCode::kNoPermission:
    case StatusCode::kVersionMismatch:
    case StatusCode::kDisconnected:
      return fail(without_promise(status.text()), kExitNoDaemon);
    case StatusCode::kTimeout:
      return fail(status.text(), kExitTimeout);
    default:
      return fail(status.text());
  }
}

int print(std::string_view text) {
  static const Look look = look_of_output();
  return print_as_is(plain_lines(text, look));
}

int print_as_is(std::string_view text) {
  std::fwrite(text.data(), 1, text.size(), stdout);
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return kExitOk;
  const int error = errno;
  return fail(std::string("cannot write to standard output: ") + std::strerror(error));
}

void tell_connection(Client& client) {
  client.on_disconnect([](const Status& status) { fail(status.text()); });
  client.on_reconnect([] { fail("connected to swarmtalkd again"); });
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
  return is_digits(word) ? client.channel(std::stoi(word), options) : client.channel(word, options);
}

bool is_new(const Subscriber& subscriber, const std::vector<Subscriber>& others) {
  const auto number = subscriber.channel_number();
  return !number || std::none_of(others.begin(), others.end(), [&](const Subscriber& each) {
    return each.channel_number() == number;
  });
}

void stop_on_signals(Client& client) {
  signal_client = &client;
  interrupt_on_signals();
}

void interrupt_on_signals() {
  usage::catch_ending_signals(on_signal, 0);
}

void tell_what_ends_a_job() {
  if (!usage::is_ignored(SIGINT)) return;
  fail(
      "kill -INT is ignored here, as in every job that a script starts with '&'; end it with: "
      "kill " +
      std::to_string(::getpid()));
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
  swarmtalk::usage::prepare(app, SWARMTALK_VERSION);
  app.add_option("--socket", parsed.common.socket_path, "the daemon's socket")
      ->type_name("FILE")
      ->check(not_empty());
  app.fallthrough();
  add_pub(app, parsed.pub);
  add_sub(app, parsed.sub, parsed.common);
  app.add_subcommand("status", "Print the daemon's links, channels and counters")
      ->add_flag("--json", parsed.common.is_json, "one JSON object");
  app.add_subcommand("stats", "Print where messages are lost: by channel, by program, by counter")
      ->add_flag("--json", parsed.common.is_json, "one JSON object");
  CLI::App* const neighbours =
      app.add_subcommand("neighbours", "Print the robots heard within the last 10 s")
          ->alias("neighbors");
  neighbours->add_flag("--json", parsed.common.is_json, "one JSON object");
  neighbours->add_flag("-v,--verbose", parsed.common.is_verbose, "also addresses and poses");
  add_reserved(app, parsed.log, parsed.harvest, parsed.common);
  add_pose(app, parsed);
  add_operation(app, parsed);
  add_kilobot(app, parsed.kilobot);
  add_recording(app, parsed.common, parsed.verb);
  add_looking(app, parsed.common, parsed.verb);
  add_screens(app, parsed.common, parsed.verb);
  doctor::add_doctor(app, parsed.common, parsed.verb);
  doctor::add_survey(app, parsed.common, parsed.verb);
  swarmtalk::usage::add_help_command(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& call) {  // --help, --version and their like
    return app.exit(call);
  } catch (const CLI::ParseError& error) {
    using namespace swarmtalk::usage;
    const std::string sentence = mistake(app, error, argc, argv) + hint(app, error, argc, argv);
    return fail(with_help(sentence, help_of(app)), kExitUsage);
  }
  try {
    return run(app, parsed);
  } catch (const std::exception& error) {
    return fail(error.what());
  }
}
