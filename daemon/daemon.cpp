#include "daemon/daemon.hpp"

#include <malloc.h>

#include <csignal>
#include <utility>

#include "daemon/common/logging.hpp"
#include "daemon/config/file_access.hpp"
#include "daemon/config/node_id_rule.hpp"
#include "daemon/host/privileges.hpp"
#include "daemon/station/link_factory.hpp"
#include "loop/loop.hpp"

namespace swarmtalk::daemon {
namespace {

// For good: links whose packets have no room for it need ids of their own.
const ParsedConfig& resolved(ParsedConfig& parsed) {
  resolve_node_id(parsed.config.node, parsed.lines);
  return parsed;
}

}  // namespace

// The socket is taken first: a second daemon must not disturb the first one's links.
Daemon::Daemon(ParsedConfig parsed, std::function<ParsedConfig()> load)
    : signals_(io_, SIGTERM, SIGINT, SIGHUP),
      socket_(ListeningSocket::open(resolved(parsed).config.socket, parsed.lines)),
      robot_(io_, std::move(parsed), std::move(load), open_link),
      service_manager_(io_, [this] { return robot_.status_line(); }) {
  const std::string& pose_socket = this->parsed().config.node.pose_socket;
  if (pose_socket.empty()) return;
  pose_socket_.emplace(io_, pose_socket, this->parsed().config.socket, this->parsed().lines,
                       robot_.poses(), robot_.counters());
}

void Daemon::run() {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is told as a full disk is
  drop_privileges();
  if (robot_.operations().has_keys()) forbid_dumps();
  const std::string made_socket = socket_.is_from_systemd() ? "" : socket_.path();
  for (const std::string& trouble :
       later_troubles(parsed().config, parsed().lines.file(), made_socket)) {
    log_of("daemon")->warn("{}", trouble);
  }
  robot_.start();
  robot_.clients().listen(socket_.descriptor());
  if (pose_socket_) pose_socket_->start();
  socket_watch_.emplace(io_, socket_.path(), [this] { return restore_socket(); });
  wait_signal();
  log_of("daemon")->info("swarmtalkd {} serves {} as node {} ({})", SWARMTALK_VERSION,
                         socket_.is_from_systemd() ? "the socket of systemd" : socket_.path(),
                         robot_.identity().id(), parsed().config.node.id_source);
  if (socket_.is_from_systemd() && socket_.is_awaited()) {
    log_of("daemon")->info(
        "a program waits at swarmtalkd.socket, which starts swarmtalkd whenever one connects; to "
        "keep it off: systemctl stop swarmtalkd.socket");
  }
  ::malloc_trim(0);  // what reading the command line and the configuration needed
  service_manager_.ready();
  loop::Loop::of(io_).run();
}

void Daemon::wait_signal() {
  signals_.async_wait([this](const boost::system::error_code& error, int signal) {
    if (!error) on_signal(signal);
  });
}

void Daemon::on_signal(int signal) {
  if (signal == SIGHUP) {
    service_manager_.reloading();
    robot_.operations().reload_on_signal();
    service_manager_.ready();
    return wait_signal();
  }
  const std::size_t lost = robot_.hub().waiting_messages();
  log_of("daemon")->info(
      "{}: ending{}", signal == SIGTERM ? "SIGTERM" : "SIGINT",
      lost == 0 ? "" : "; messages that have not left and are given up: " + std::to_string(lost));
  service_manager_.stopping();
  robot_.clients().close_all("swarmtalkd ends");
  io_.stop();
}

// Says each thing once, however often it is tried.
bool Daemon::restore_socket() {
  const bool is_first = !std::exchange(is_socket_gone_, true);
  if (socket_.is_from_systemd()) {
    if (is_first) {
      log_of("client")->error(
          "the socket file {} was deleted, so no program can connect; run: systemctl restart "
          "swarmtalkd.socket swarmtalkd.service",
          socket_.path());
    }
    return false;
  }
  try {
    socket_.restore(parsed().config.socket, parsed().lines);
  } catch (const std::exception& error) {
    if (is_first) {
      log_of("client")->error("the socket file was deleted, so no program can connect: {}",
                              error.what());
    }
    return false;
  }
  is_socket_gone_ = false;
  robot_.clients().listen(socket_.descriptor());
  log_of("client")->warn("the socket file {} was deleted and has been made again", socket_.path());
  return true;
}

}  // namespace swarmtalk::daemon
