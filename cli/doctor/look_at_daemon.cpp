#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <filesystem>

#include "cli/common/deadline.hpp"
#include "cli/common/operator.hpp"
#include "cli/doctor/look.hpp"
#include "client_lib/connection.hpp"
#include "ipc/framing.hpp"
#include "text/plain.hpp"

namespace swarmtalk::cli::doctor {
namespace {

constexpr const char* kUsualConfigFile = "/etc/swarmtalk/swarmtalkd.toml";

DaemonFacts::State state_of(StatusCode code) {
  using State = DaemonFacts::State;
  switch (code) {
    case StatusCode::kNoDaemon:
      return State::kAbsent;
    case StatusCode::kDaemonDead:
      return State::kDead;
    case StatusCode::kNoPermission:
      return State::kNoPermission;
    default:
      return State::kOther;
  }
}

/// Waits so long, or until a signal.
void pause(double wanted_s) {
  const auto end = after(Clock::now(), seconds(wanted_s));
  while (caught_signal() == 0 && Clock::now() < end) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now());
    ::poll(nullptr, 0, static_cast<int>(std::clamp<std::int64_t>(left.count(), 1, 1000)));
  }
}

/// A program beside ours, or where daemons are installed; empty: not found.
std::string find_daemon_program() {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path own = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (const fs::path& folder :
       {own / "../sbin", own / "../daemon", fs::path("/usr/sbin"), fs::path("/usr/local/sbin")}) {
    const fs::path program = folder / "swarmtalkd";
    if (::access(program.c_str(), X_OK) == 0) return program.lexically_normal().string();
  }
  return {};
}

/// What `swarmtalkd --check` says of a file; none: it is right and gives this machine a node id, or
/// nobody can be asked.
std::optional<std::string> check_file(const std::string& file) {
  const std::string program = find_daemon_program();
  if (program.empty() || ::access(file.c_str(), F_OK) != 0) return std::nullopt;
  std::array<int, 2> pipe{};
  if (::pipe(pipe.data()) != 0) return std::nullopt;
  const pid_t child = ::fork();
  if (child == 0) {
    ::dup2(pipe[1], STDERR_FILENO);
    ::dup2(pipe[1], STDOUT_FILENO);
    ::close(pipe[0]);
    ::execl(program.c_str(), program.c_str(), "--check", "--config", file.c_str(), nullptr);
    ::_exit(127);
  }
  ::close(pipe[1]);
  std::string text;
  std::array<char, 512> bytes{};
  for (;;) {
    const ssize_t size = ::read(pipe[0], bytes.data(), bytes.size());
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0 || text.size() > bytes.size() * 8) break;
    text.append(bytes.data(), static_cast<std::size_t>(size));
  }
  ::close(pipe[0]);
  int status = 0;
  if (child < 0 || ::waitpid(child, &status, 0) != child) return std::nullopt;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
    constexpr std::string_view kNotHere = "this machine cannot run with it: ";
    const std::size_t found = text.find(kNotHere);
    if (found == std::string::npos) return std::nullopt;
    text.erase(0, found + kNotHere.size());
  }
  text = text.substr(0, text.find('\n'));
  constexpr std::string_view kOwnName = "swarmtalkd: ";
  return text.starts_with(kOwnName) ? text.substr(kOwnName.size()) : text;
}

void compare_configuration(OperatorConnection& daemon, DaemonFacts& facts) {
  ipc::Envelope question;
  ipc::Envelope answer;
  question.mutable_check_configuration();
  if (const Status status = daemon.request(question, answer); !status) {
    // What else is wrong with the daemon is found by the other looks.
    if (status.code() == StatusCode::kBadArgument) facts.config_error = status.text();
    return;
  }
  facts.is_config_compared = true;
  if (answer.reloaded().has_node_id_stays()) facts.id_trouble = answer.reloaded().node_id_stays();
  for (const std::string& key : answer.reloaded().applied()) facts.config_reload.push_back(key);
  for (const std::string& key : answer.reloaded().needs_restart()) {
    facts.config_restart.push_back(key);
  }
}

std::uint64_t value_of(const ipc::LinkStatus& link, const std::string& name) {
  for (const ipc::Counter& each : link.counters()) {
    if (each.name() == name) return each.value();
  }
  return 0;
}

std::uint64_t value_of(const ipc::Status& status, const std::string& name) {
  for (const ipc::Counter& each : status.counters()) {
    if (each.name() == name) return each.value();
  }
  return 0;
}

LinkFacts facts_of(const ipc::LinkStatus& link, const ipc::LinkStatus* before) {
  LinkFacts facts;
  facts.name = link.name();
  facts.type = link.type();
  facts.device = link.device();
  facts.interface = link.interface();
  if (facts.interface.empty() && link.type() == "raw_l2") facts.interface = link.device();
  facts.is_up = link.up();
  facts.state = link.state();
  facts.packet_bytes = link.mtu_bytes();
  facts.packet_limit_bytes = link.packet_limit_bytes();
  facts.ethertype = link.ethertype();
  facts.is_sealed = link.sealed();
  facts.air_rate_mbps = link.air_rate_mbps();
  if (link.has_forward_jitter_us()) facts.forward_jitter_us = link.forward_jitter_us();
  facts.packets_forwarded = value_of(link, "node_packets_forwarded");
  if (link.has_asked_buffer_bytes()) facts.asked_buffer_bytes = link.asked_buffer_bytes();
  facts.given_buffer_bytes = link.given_buffer_bytes();
  facts.node_id = link.node_id();
  for (const ipc::Counter& each : link.counters()) {
    const std::uint64_t old = before == nullptr ? each.value() : value_of(*before, each.name());
    facts.rises[each.name()] = each.value() - std::min(old, each.value());
  }
  return facts;
}

}  // namespace

DaemonWords words_for(const std::string& socket) {
  if (socket == ipc::kDefaultSocketPath) return {};
  const std::string lab = " (a lab: swarmtalk-lab down, then up)";
  return {"swarmtalk-cli --socket " + text::shell_word(socket),
          "start swarmtalkd for that socket again" + lab, "end swarmtalkd and start it again" + lab,
          "its log"};
}

void take_status(const ipc::Status& first, const ipc::Status& second, DaemonFacts& facts) {
  facts.version = second.version();
  facts.node_id = second.node_id();
  facts.is_id_fixed = second.node_id_fixed();
  facts.node_id_source = second.node_id_source();
  facts.config_file = second.config_file();
  const std::uint64_t collisions = value_of(second, "duplicate_node_ids");
  facts.id_collisions = collisions - std::min(collisions, value_of(first, "duplicate_node_ids"));
  for (const ipc::LinkStatus& link : second.links()) {
    const ipc::LinkStatus* before = nullptr;
    for (const ipc::LinkStatus& each : first.links()) {
      if (each.name() == link.name()) before = &each;
    }
    facts.links.push_back(facts_of(link, before));
  }
}

void take_neighbours(const ipc::Neighbours& neighbours, DaemonFacts& facts) {
  for (const ipc::Neighbour& each : neighbours.neighbours()) {
    NeighbourFacts& made = facts.neighbours.emplace_back();
    made.link = each.link();
    made.node_id = each.node_id();
    made.address = each.address();
    made.frames = each.frames();
    made.age_ms = each.age_ms();
    made.is_duplicate = each.duplicate_id();
    made.is_ghost = each.ghost();
    made.loss = static_cast<double>(each.loss());
    made.loss_frames = each.loss_frames();
    if (each.has_signal_dbm()) made.signal_dbm = each.signal_dbm();
  }
}

DaemonFacts look_at_daemon(const Common& common, double seconds, const std::string& config_file) {
  DaemonFacts facts;
  const std::string socket = client::socket_path(common.socket_path);
  facts.words = words_for(socket);
  const bool is_usual = socket == ipc::kDefaultSocketPath;
  facts.config_file = config_file.empty() && is_usual ? kUsualConfigFile : config_file;
  OperatorConnection daemon;
  ipc::Envelope question;
  ipc::Envelope first;
  ipc::Envelope second;
  ipc::Envelope neighbours;
  question.mutable_get_status();
  Status status = daemon.open(common.socket_path);
  if (status) status = daemon.request(question, first);
  if (status) {
    pause(seconds);
    status = daemon.request(question, second);
  }
  if (status) {
    ipc::Envelope asking;
    asking.mutable_get_neighbours();
    status = daemon.request(asking, neighbours);
  }
  if (!status) {
    facts.state = state_of(status.code());
    facts.trouble = status.text();
    if (facts.state != DaemonFacts::State::kNoPermission && !facts.config_file.empty()) {
      facts.config_error = check_file(facts.config_file);
    }
    return facts;
  }
  take_status(first.status(), second.status(), facts);
  take_neighbours(neighbours.neighbours(), facts);
  compare_configuration(daemon, facts);
  return facts;
}

}  // namespace swarmtalk::cli::doctor
