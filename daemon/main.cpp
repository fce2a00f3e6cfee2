// swarmtalkd: command line, exit codes, and nothing else.
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "daemon/common/logging.hpp"
#include "daemon/common/printable.hpp"
#include "daemon/config/config_parser.hpp"
#include "daemon/config/node_id_rule.hpp"
#include "daemon/daemon.hpp"
#include "usage/mistakes.hpp"
#include "usage/usage.hpp"

namespace {

constexpr int kExitError = 1;
constexpr int kExitUsage = 2;
constexpr std::size_t kMaxUsageBytes = 200;
constexpr rlim_t kEnoughDescriptors = 1024;

using namespace swarmtalk::daemon;

struct Options {
  std::string config_file = kDefaultConfigPath;
  ConfigOptions instead;
  bool is_check = false;
};

void add_options(CLI::App& app, Options& options) {
  // Not the optionals themselves: CLI11 takes an empty word for none, and --socket "" is wrong.
  const auto into = [](std::optional<std::string>& place) {
    return [&place](const std::string& word) { place = word; };
  };
  app.add_option("--config", options.config_file, "configuration file (TOML)")
      ->type_name("FILE")
      ->capture_default_str();
  app.add_flag("--check", options.is_check, "read the configuration file, say what is wrong, end");
  app.add_option_function<std::string>("--socket", into(options.instead.socket_path),
                                       "path of the socket, instead of socket.path")
      ->type_name("FILE");
  app.add_option_function<std::string>(
      "--node-id", into(options.instead.node_id),
      "\"auto\", \"hostname\", \"ip\" or 1 to 65534, instead of node.id");
  app.add_option_function<std::string>("--log-level", into(options.instead.log_level),
                                       "instead of log.level")
      ->check(CLI::IsMember(std::vector<std::string>(kLogLevels.begin(), kLogLevels.end())));
}

/// What ended the daemon; when that was its limit of descriptors, wherever it met that, the limit.
std::string reason(const std::string& what) {
  const std::string at_limit = std::strerror(EMFILE);
  const std::size_t found = what.find(at_limit);
  if (found == std::string::npos || what.find(std::strerror(ENFILE)) == found) return what;
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  const std::string enough = std::to_string(std::max(kEnoughDescriptors, 2 * limit.rlim_cur));
  return "too many open files: the limit is " + std::to_string(limit.rlim_cur) +
         "; raise it with `ulimit -n " + enough + "` (systemd: LimitNOFILE=" + enough + ")";
}

/// As which node this machine would run, if that depends on the machine. The file is right even if
/// it is none: it may be for others.
std::string id_here(ParsedConfig& parsed) {
  NodeConfig& node = parsed.config.node;
  if (node.id_rule == NodeIdRule::kRandom || node.id_rule == NodeIdRule::kNumber) return "";
  try {
    resolve_node_id(node, parsed.lines);
  } catch (const ConfigError& error) {
    return std::string("this machine cannot run with it: ") + error.what() + "\n";
  }
  return "this machine is node " + std::to_string(*node.id) + " (" + node.id_source + ")\n";
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Publish/subscribe over broadcast frames for the programs of a robot.",
               "swarmtalkd");
  Options options;
  swarmtalk::usage::prepare(app, std::string("swarmtalkd ") + SWARMTALK_VERSION);
  add_options(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    const std::string sentence = swarmtalk::usage::mistake(app, error, argc, argv);
    std::fprintf(
        stderr, "swarmtalkd: %s\n",
        swarmtalk::usage::with_help(printable(sentence, kMaxUsageBytes), "swarmtalkd --help")
            .c_str());
    return kExitUsage;
  }
  try {
    // Clients show it to users whose folder may be another. The one of this start may be gone.
    std::error_code error;
    const std::string whole = std::filesystem::absolute(options.config_file, error);
    if (!options.is_check && !error) options.config_file = whole;
    const auto load = [&options] { return load_config(options.config_file, options.instead); };
    ParsedConfig parsed = load();
    if (options.is_check) {
      std::printf("%s: ok\n%s", options.config_file.c_str(), id_here(parsed).c_str());
      return 0;
    }
    start_logging(parsed.config.log_level, parsed.config.log_levels);
    Daemon(std::move(parsed), load).run();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", reason(error.what()).c_str());
    return kExitError;
  }
}
