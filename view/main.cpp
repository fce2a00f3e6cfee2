// swarmtalk-view: a map of the swarm in a browser, live or from a recording.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "usage/checks.hpp"
#include "usage/ending_signals.hpp"
#include "usage/mistakes.hpp"
#include "usage/usage.hpp"
#include "view/access.hpp"
#include "view/observer.hpp"
#include "view/playback.hpp"
#include "view/server.hpp"
#include "view/stage.hpp"

namespace swarmtalk::view {
namespace {

// One line for each paragraph: they are folded to the terminal.
constexpr const char* kFooter =
    "The socket is --socket PATH, else $SWARMTALK_SOCKET, else "
    "/run/swarmtalk/swarmtalkd.sock. When the daemon ends, swarmtalk-view waits for the next one.\n"
    "With FILE no daemon is asked: the page shows the recording, with play, pause and a timeline.\n"
    "Exit codes: 1 failed, as when the port is in use or FILE is no recording; 2 wrong usage; 3 "
    "the "
    "daemon cannot be reached at the start; 128+N ended by signal N.";
constexpr int kExitFailure = 1;
constexpr int kExitUsage = 2;
constexpr int kExitNoDaemon = 3;
constexpr int kExitSignal = 128;
constexpr std::size_t kMostTokenFileBytes = 4096;

struct Arguments {
  ObserverOptions observer;
  std::string recording;  // empty: live
  std::string address = "127.0.0.1";
  std::uint16_t port = 8080;
  std::string token_file;
  std::vector<std::string> origins;
  bool may_operate = false;
};

int fail(const std::string& text, int exit_code) {
  std::fprintf(stderr, "swarmtalk-view: %s\n", text.c_str());
  return exit_code;
}

std::string read_token(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text(kMostTokenFileBytes, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  return token_of(text, path);
}

std::string random_token() {
  static constexpr char kLetters[] = "abcdefghijkmnpqrstuvwxyz23456789";  // 32, none alike
  std::random_device random;
  std::string token;
  for (int i = 0; i < 24; ++i) token.push_back(kLetters[random() % 32]);
  return token;
}

/// As a browser writes it: scheme and host, and no path.
CLI::Validator origin() {
  const auto check = [](const std::string& word) {
    const auto scheme = word.find("://");
    const auto is_scheme_letter = [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '+' || c == '-' || c == '.';
    };
    const bool has_scheme =
        scheme != std::string::npos && scheme > 0 &&
        std::all_of(word.begin(), word.begin() + static_cast<std::ptrdiff_t>(scheme),
                    is_scheme_letter);
    const std::string host = has_scheme ? word.substr(scheme + 3) : "";
    const bool is_good =
        has_scheme && (!host.empty() || word == "file://") &&
        std::none_of(host.begin(), host.end(), [](unsigned char c) {
          return c <= ' ' || c == '/' || c == '*' || c == ',' || c >= 127 || std::isupper(c) != 0;
        });
    return is_good ? std::string()
                   : "must be an origin as a browser writes it, in small letters and without a "
                     "path, as http://lab:8081, not " +
                         (word.empty() ? "nothing" : word);
  };
  return CLI::Validator(check, "");
}

void tell_address(const Server& server, const std::string& address) {
  const std::string port = std::to_string(server.rules().port);
  std::string line = "swarmtalk-view: http://localhost:" + port + "/";
  if (!server.is_local_only()) {
    const bool is_any = address == "0.0.0.0" || address == "::";
    const bool is_v6 = address.find(':') != std::string::npos;
    const std::string host = is_any ? "THIS-MACHINE" : is_v6 ? "[" + address + "]" : address;
    line +=
        "   from other machines: http://" + host + ":" + port + "/?token=" + server.rules().token;
  }
  if (std::printf("%s\n", line.c_str()) < 0 || std::fflush(stdout) != 0) {
    std::fprintf(stderr, "%s (standard output cannot be written: %s)\n", line.c_str(),
                 std::strerror(errno));
  }
}

int serve(const Arguments& arguments) {
  boost::asio::io_context io{1};
  int signal_number = 0;
  boost::asio::signal_set signals(io);
  for (const int signal : usage::kEndingSignals) {
    if (!usage::is_ignored(signal)) signals.add(signal);
  }
  signals.async_wait([&](const boost::system::error_code& error, int number) {
    if (error) return;
    signal_number = number;
    io.stop();
  });
  std::optional<Observer> observer;
  std::optional<Playback> playback;
  if (arguments.recording.empty()) {
    observer.emplace(io, arguments.observer);
    if (const Status status = observer->start(); !status) {
      return fail(std::string(status.text()), is_refused(status) ? kExitFailure : kExitNoDaemon);
    }
  } else {
    playback.emplace(io);
    if (const std::string problem = playback->open(arguments.recording); !problem.empty()) {
      return fail(problem, kExitFailure);
    }
    if (!playback->problem().empty()) {
      fail(arguments.recording + ": " + playback->problem(), kExitFailure);
    }
  }
  Source& source = playback ? static_cast<Source&>(*playback) : *observer;
  Stage stage(io, source, arguments.may_operate);
  AccessRules rules;
  rules.port = arguments.port;
  rules.allowed_origins = arguments.origins;
  if (!arguments.token_file.empty()) rules.token = read_token(arguments.token_file);
  const bool is_local = boost::asio::ip::make_address(arguments.address).is_loopback();
  if (!is_local && rules.token.empty()) rules.token = random_token();
  Server server(io, arguments.address, rules, stage);
  tell_address(server, arguments.address);
  io.run();
  server.stop();
  io.restart();
  io.poll();  // what was under way ends, while what it refers to is there
  return kExitSignal + signal_number;
}

int run(int argc, char** argv) {
  Arguments arguments;
  CLI::App app{
      "Shows the swarm in a browser: a map, channels, messages and log lines; live, or those of a "
      "recording."};
  app.footer(kFooter);
  usage::prepare(app, "swarmtalk-view " SWARMTALK_VERSION);
  app.add_option("FILE", arguments.recording,
                 "recording of swarmtalk-cli record, in place of a daemon")
      ->check(usage::not_empty());
  auto* const socket = app.add_option("--socket", arguments.observer.socket_path, "of the daemon")
                           ->check(usage::not_empty());
  app.add_option("--listen", arguments.address,
                 "address to listen on; other than this machine's own, a token is needed")
      ->check(usage::not_empty())
      ->capture_default_str();
  app.add_option("--port", arguments.port, "0: any that is free")
      ->check(usage::whole_number(65535))
      ->capture_default_str();
  app.add_option("--token-file", arguments.token_file,
                 "file with the token; default: a new one at each start")
      ->check(usage::not_empty());
  app.add_option(
         "--allow-origin", arguments.origins,
         "a page from elsewhere that may look, as http://lab:8081; may be given more than once")
      ->check(origin())
      ->allow_extra_args(false);
  auto* const channel =
      app.add_option("--channel", arguments.observer.channels,
                     "a channel to listen to, besides those that programs of this robot use")
          ->check(usage::channel())
          ->allow_extra_args(false);  // FILE may follow
  auto* const operate =
      app.add_flag("--operate", arguments.may_operate, "whoever looks may also send messages");
  try {
    app.parse(argc, argv);
    for (const auto* option : {socket, channel, operate}) {
      if (arguments.recording.empty() || option->count() == 0) continue;
      return fail(option->get_name() + " is for a daemon, and " + arguments.recording +
                      " is a recording: leave one of them out",
                  kExitUsage);
    }
    boost::system::error_code error;
    boost::asio::ip::make_address(arguments.address, error);
    if (error) {
      return fail("--listen takes an address of this machine, such as 127.0.0.1 or 0.0.0.0, not " +
                      arguments.address,
                  kExitUsage);
    }
    return serve(arguments);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    const std::string sentence = usage::mistake(app, error, argc, argv);
    return fail(usage::with_help(sentence, "swarmtalk-view --help"), kExitUsage);
  } catch (const std::exception& error) {
    return fail(error.what(), kExitFailure);
  }
}

}  // namespace
}  // namespace swarmtalk::view

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);
  return swarmtalk::view::run(argc, argv);
}
