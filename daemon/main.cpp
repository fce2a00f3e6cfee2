// swarmtalkd: command line, exit codes, and nothing else.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <string>
#include <utility>

#include "daemon/config_parser.hpp"
#include "daemon/daemon.hpp"
#include "daemon/logging.hpp"
#include "daemon/node_id_rule.hpp"
#include "daemon/printable.hpp"

namespace {

constexpr int kExitError = 1;
constexpr int kExitUsage = 2;
constexpr std::size_t kMaxUsageBytes = 200;

using namespace swarmtalk::daemon;

struct Options {
  std::string config_file = kDefaultConfigPath;
  std::string socket_path;
  bool has_socket_path = false;  // which may be empty, and wrong
  std::string node_id;
  bool has_node_id = false;
  std::string log_level;
  bool is_check = false;
};

void add_options(CLI::App& app, Options& options) {
  app.add_option("--config", options.config_file, "configuration file (TOML)")
      ->capture_default_str();
  app.add_flag("--check", options.is_check, "read the configuration file, say what is wrong, end");
  app.add_option("--socket", options.socket_path, "path of the socket, instead of socket.path");
  app.add_option("--node-id", options.node_id,
                 "\"auto\", \"hostname\", \"ip\" or 1 to 65534, instead of node.id");
  app.add_option("--log-level", options.log_level, "instead of log.level")
      ->check(CLI::IsMember({"trace", "debug", "info", "warning", "error"}));
  app.set_version_flag("--version", std::string("swarmtalkd ") + SWARMTALK_VERSION);
}

ParsedConfig load(const Options& options) {
  ParsedConfig parsed = load_config(options.config_file);
  if (!options.log_level.empty()) {
    parsed.config.log_level = options.log_level;
    parsed.lines.set_option("log.level", "--log-level");
  }
  if (options.has_node_id) {
    parsed.lines.set_option("node.id", "--node-id");
    const std::string problem = read_node_id_rule(options.node_id, parsed.config.node);
    if (!problem.empty()) throw parsed.lines.error("node.id", problem);
  }
  if (options.has_socket_path) {
    parsed.lines.set_option("socket.path", "--socket");
    const std::string problem = socket_path_problem(options.socket_path);
    if (!problem.empty()) throw parsed.lines.error("socket.path", problem);
    parsed.config.socket.path = options.socket_path;
  }
  return parsed;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Publish/subscribe over broadcast frames for the programs of a robot.",
               "swarmtalkd");
  Options options;
  add_options(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    std::fprintf(stderr, "swarmtalkd: %s; see swarmtalkd --help\n",
                 printable(error.what(), kMaxUsageBytes).c_str());
    return kExitUsage;
  }
  options.has_socket_path = app.count("--socket") > 0;
  options.has_node_id = app.count("--node-id") > 0;
  try {
    ParsedConfig parsed = load(options);
    if (options.is_check) {
      std::printf("%s: ok\n", options.config_file.c_str());
      return 0;
    }
    start_logging(parsed.config.log_level, parsed.config.log_levels);
    Daemon(std::move(parsed), [&options] { return load(options); }).run();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return kExitError;
  }
}
