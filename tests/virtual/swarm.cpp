#include "tests/virtual/swarm.hpp"

#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <stdexcept>
#include <utility>

#include "daemon/config/node_id_rule.hpp"
#include "loop/clock.hpp"
#include "tests/support/turned_clock.hpp"
#include "tests/virtual/seeded_nonces.hpp"

namespace swarmtalk::test {
namespace {

Swarm* the_swarm = nullptr;  // NOLINT: streams and waits are functions

ClientOptions options_for(const std::string& socket) {
  ClientOptions options;
  options.socket_path = socket;
  return options;
}

}  // namespace

VirtualProgram::VirtualProgram(int programs, const std::string& name, const std::string& socket)
    : programs_(programs), client_(name, options_for(socket)) {
  set_running(true);
}

void VirtualProgram::set_running(bool is_running) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.ptr = this;
  ::epoll_ctl(programs_, is_running ? EPOLL_CTL_ADD : EPOLL_CTL_DEL, client_.fd(), &event);
}

void VirtualProgram::subscribe(const std::string& channel, const Policy& policy) {
  subscribers_.push_back(client_.subscribe(channel, policy, [this](const Message& message) {
    if (const std::uint64_t lost = message.lost_before.total(); lost > 0) {
      heard_.push_back("lost " + std::to_string(lost));
    }
    heard_.emplace_back(message.text());
  }));
}

void VirtualProgram::advertise(const std::string& channel, const Sending& sending) {
  publishers_[channel] = client_.advertise(
      channel, sending, [this](const Status& status) { ++(status ? sent_ : failed_); });
}

void VirtualProgram::send(const std::string& channel, const std::string& text,
                          std::optional<std::uint32_t> ttl) {
  if (!publishers_.contains(channel)) advertise(channel);
  if (const Status status = publishers_[channel].send(text, ttl); !status) throw Error(status);
}

VirtualRobot::VirtualRobot(Swarm& swarm, int number, std::string configuration)
    : swarm_(swarm),
      number_(number),
      configuration_(std::move(configuration)),
      machine_(swarm.machines(), "robot " + std::to_string(number)) {
  start();
}

std::string VirtualRobot::socket_path() const {
  return "/virtual/" + std::to_string(number_);
}

VirtualProgram& VirtualRobot::program(const std::string& name) {
  std::unique_ptr<VirtualProgram>& made = programs_[name];
  if (made == nullptr)
    made = std::make_unique<VirtualProgram>(swarm_.programs(), name, socket_path() + "/" + name);
  return *made;
}

void VirtualRobot::kill_program(const std::string& name) {
  const auto killed = programs_.find(name);
  if (killed == programs_.end()) return;
  if (killed->second->client().is_connected()) swarm_.cut_off(socket_path() + "/" + name);
  killed->second->set_running(false);
  killed_.push_back(std::move(killed->second));
  programs_.erase(killed);
}

std::uint64_t VirtualRobot::counter(const std::string& name, const std::string& link) {
  DaemonStatus status;
  if (const Status asked = program("observer").client().get_status(status); !asked) {
    throw Error(asked);
  }
  for (const auto& on : status.links) {
    for (const Counter& each : on.counters) {
      if (on.name == link && each.name == name) return each.value;
    }
  }
  throw std::out_of_range("no counter " + name + " of a link " + link);
}

void VirtualRobot::stop() {
  enter(machine_.io());
  robot_.reset();
}

void VirtualRobot::start() {
  const auto load = [this] {
    const bool has_links = configuration_.starts_with("[links.");
    const std::string text = "[node]\nid = " + std::to_string(number_) + "\n" +
                             (has_links ? "" : "[links.air]\ntype = \"udp\"\n") + configuration_;
    daemon::ConfigOptions options;
    options.socket_path = socket_path();
    return daemon::parse_config(text, "virtual.toml", options);
  };
  daemon::ParsedConfig parsed = load();
  daemon::resolve_node_id(parsed.config.node, parsed.lines);
  enter(machine_.io());
  robot_ = std::make_unique<daemon::Robot>(
      machine_.io(), std::move(parsed), load,
      [this](boost::asio::io_context& io, const daemon::LinkConfig& config, const daemon::KeyLines&,
             frame::ProfileId profile, std::size_t max_packet_bytes) {
        return swarm_.air(config.name).open(io, number_, config, profile, max_packet_bytes);
      });
  robot_->start();
}

Swarm::Swarm(std::uint64_t seed)
    : machines_(::epoll_create1(EPOLL_CLOEXEC)),
      world_(machines_, "the air"),
      programs_(::epoll_create1(EPOLL_CLOEXEC)),
      chance_(static_cast<std::mt19937::result_type>(seed)),
      seed_(seed) {
  begin(seed);
  seed_nonces();
  the_swarm = this;
}

Swarm::~Swarm() {
  for (const auto& [number, robot] : robots_) robot->end_programs();  // they still ask and wait
  robots_.clear();
  ::close(programs_);
  ::close(machines_);
  the_swarm = nullptr;
}

VirtualRobot& Swarm::add(int number, Place place, const std::string& configuration) {
  places_[number] = place;
  return *robots_.emplace(number, std::make_unique<VirtualRobot>(*this, number, configuration))
              .first->second;
}

Air& Swarm::air(const std::string& link) {
  const std::uint64_t number = airs_.size();
  return airs_.try_emplace(link, world_.io(), number, seed_ + number, course_, places_)
      .first->second;
}

void Swarm::advance(std::chrono::nanoseconds duration) {
  const auto end = loop::now() + duration;
  while (run_daemons([this] { return run_program(); }, end - loop::now())) {
  }
}

bool Swarm::run_daemons(const std::function<bool()>& is_done, std::chrono::nanoseconds limit) {
  const auto end = loop::now() + limit;
  const auto run_ready = [this] { return run_machines(); };
  if (pass_until(run_ready, is_done, limit)) return true;
  pass(run_ready, end - loop::now());
  return is_done();
}

/// Until nothing is ready. @return false: nothing was
bool Swarm::run_machines() {
  std::array<epoll_event, 32> events;
  bool has_run = false;
  for (;;) {
    bool has_more = false;
    for (const auto& [number, robot] : robots_) {
      if (!robot->machine().has_work()) continue;
      robot->machine().turn();
      has_more = true;
    }
    const int count = ::epoll_wait(machines_, events.data(), events.size(), 0);
    for (int i = 0; i < count; ++i) {
      static_cast<Machine*>(events[static_cast<std::size_t>(i)].data.ptr)->turn();
    }
    if (!has_more && count <= 0 && !world_.has_work()) return has_run;
    has_run = true;
  }
}

/// One that has something to do. @return false: none has
bool Swarm::run_program() {
  epoll_event event;
  if (::epoll_wait(programs_, &event, 1, 0) <= 0) return false;
  static_cast<VirtualProgram*>(event.data.ptr)->client().process();
  return true;
}

Swarm* Swarm::present() {
  return the_swarm;
}

int Swarm::connect(int fd, const std::string& path) {
  const auto found = std::find_if(robots_.begin(), robots_.end(), [&](const auto& each) {
    return path.starts_with(each.second->socket_path() + "/") && each.second->has_started();
  });
  if (found == robots_.end()) return ECONNREFUSED;
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends) != 0) return errno;
  ::dup3(ends[0], fd, O_CLOEXEC);
  ::close(ends[0]);
  streams_[path] = fd;
  found->second->parts().clients().add(ends[1]);
  return 0;
}

void Swarm::cut_off(const std::string& path) {
  const auto stream = streams_.find(path);
  if (stream != streams_.end()) ::shutdown(stream->second, SHUT_RDWR);
}

void Swarm::cut_streams(std::size_t bytes, double share) {
  longest_piece_ = bytes;
  cut_share_ = share;
}

std::size_t Swarm::piece_of(std::size_t bytes) {
  if (longest_piece_ == SIZE_MAX || bytes == 0) return bytes;
  if (static_cast<double>(chance_()) >= cut_share_ * 0x1p32) return bytes;
  const std::size_t piece = 1 + chance_() % longest_piece_;
  return std::min(bytes, piece);
}

}  // namespace swarmtalk::test
