#include "daemon/daemon.hpp"

#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>

#include <chrono>
#include <csignal>
#include <limits>
#include <utility>

#include "daemon/config_gateways.hpp"
#include "daemon/privileges.hpp"
#include "daemon/station_factory.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr auto kLinkWatchPeriod = std::chrono::seconds(1);

}  // namespace

// The socket is taken first: a second daemon must not disturb the first one's links.
Daemon::Daemon(const ParsedConfig& parsed)
    : config_(parsed.config),
      identity_(config_.node.id),
      poses_(config_.node),
      names_(config_.channels),
      hub_(names_, config_.limits, counters_, identity_),
      status_(hub_, poses_, identity_, counters_, parsed.lines.file()),
      socket_(ListeningSocket::open(config_.socket, parsed.lines)),
      clients_(io_, hub_, poses_, config_.limits, counters_, status_),
      signals_(io_, SIGTERM, SIGINT, SIGHUP),
      link_timer_(io_),
      copy_timer_(io_) {
  status_.set_clients(clients_);
  open_stations(parsed.lines);
}

void Daemon::open_stations(const KeyLines& lines) {
  for (const LinkConfig& link : config_.links) {
    stations_.push_back(make_station(io_, link, lines, identity_for(link), poses_, hub_));
    hub_.add(*stations_.back());
    if (link.type == LinkType::kKilobot) add_kilobots(link, *stations_.back());
  }
  if (const auto refusal = hub_.set_gateways(config_.gateways)) {
    throw lines.error("gateway", refusal->text);
  }
}

void Daemon::add_kilobots(const LinkConfig& link, Station& station) {
  auto& kilobots = dynamic_cast<kilobot_bridge::KilobotLink&>(station.link());
  kilobots_.add(link.name, kilobots);
  clients_.kilobots = &kilobots_;
  if (!link.kilobot.is_text) return;
  kilobots.set_text_hook([this, &station, channel = link.kilobot.text_channel,
                          number = std::uint32_t{0}](const std::string& line) mutable {
    MessageHead head;
    head.channel = channel;
    head.sender = station.identity().id();
    head.epoch = identity_.epoch() & 0xFFFFu;
    head.number = ++number;
    head.distance_m = head.bearing_rad = std::numeric_limits<float>::quiet_NaN();
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    head.received_at_ns = static_cast<std::uint64_t>(
        std::chrono::duration_cast<std::chrono::nanoseconds>(now).count());
    hub_.on_message(station, head,
                    {reinterpret_cast<const std::uint8_t*>(line.data()), line.size()});
  });
}

NodeIdentity& Daemon::identity_for(const LinkConfig& link) {
  const auto own = own_ids(config_, link);
  if (!own && !link.node_id) return identity_;
  const NodeIdRange range = own ? NodeIdRange{own->least, own->most} : NodeIdRange{};
  link_identities_.push_back(
      std::make_unique<NodeIdentity>(link.node_id, range, identity_.epoch()));
  return *link_identities_.back();
}

Daemon::~Daemon() {
  clients_.close_all("swarmtalkd ends");
}

void Daemon::run() {
  std::signal(SIGPIPE, SIG_IGN);
  drop_privileges();
  for (const auto& station : stations_) {
    station->start();
    spdlog::debug("link {}: {} on {}, {}", station->name(), station->link().type(),
                  station->link().device(), station->link().state());
  }
  clients_.listen(socket_.descriptor());
  wait_signal();
  hub_.set_waiting_hook([this] { watch_links(); });
  hub_.set_copy_hook([this](Hub::Time at) { wait_for_copy(at); });
  spdlog::info("swarmtalkd {} serves {} as node {}{}", SWARMTALK_VERSION,
               socket_.is_from_systemd() ? "the socket of systemd" : socket_.path(), identity_.id(),
               identity_.is_fixed() ? "" : " (chosen at random)");
  notify_ready();
  io_.run();
}

void Daemon::wait_signal() {
  signals_.async_wait([this](const boost::system::error_code& error, int signal) {
    if (error) return;
    if (signal == SIGHUP) {
      spdlog::warn(
          "SIGHUP: the configuration is read at start only; restart swarmtalkd to apply "
          "changes");
      return wait_signal();
    }
    spdlog::info("{}: ending", signal == SIGTERM ? "SIGTERM" : "SIGINT");
    sd_notify(0, "STOPPING=1");
    clients_.close_all("swarmtalkd ends");
    io_.stop();
  });
}

// Runs only while messages wait: an idle daemon does not wake up.
void Daemon::watch_links() {
  if (std::exchange(is_watching_links_, true)) return;
  link_timer_.expires_after(kLinkWatchPeriod);
  link_timer_.async_wait([this](const boost::system::error_code& error) {
    if (error) return;
    is_watching_links_ = false;
    if (hub_.give_up_on_dead_links()) watch_links();
  });
}

void Daemon::wait_for_copy(Hub::Time at) {
  copy_timer_.expires_at(at);  // a wait for a later one is cancelled
  copy_timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error) hub_.send_copies(std::chrono::steady_clock::now());
  });
}

void Daemon::notify_ready() const {
  const std::string state = "READY=1\nSTATUS=node " + std::to_string(identity_.id()) + ", " +
                            std::to_string(stations_.size()) +
                            (stations_.size() == 1 ? " link" : " links");
  sd_notify(0, state.c_str());
}

}  // namespace swarmtalk::daemon
