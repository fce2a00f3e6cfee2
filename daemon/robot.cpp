#include "daemon/robot.hpp"

#include <chrono>
#include <limits>
#include <utility>

#include "daemon/common/logging.hpp"
#include "daemon/common/monotonic_ns.hpp"
#include "daemon/config/config_gateways.hpp"
#include "daemon/operator/prometheus.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr auto kLinkWatchPeriod = std::chrono::seconds(1);

}  // namespace

Robot::Robot(boost::asio::io_context& io, ParsedConfig parsed, std::function<ParsedConfig()> load,
             const LinkOpener& open)
    : io_(io),
      parsed_(std::move(parsed)),
      identity_(parsed_.config.node.id),
      poses_(parsed_.config.node),
      names_(parsed_.config.channels),
      hub_(names_, parsed_.config.limits, counters_, identity_),
      status_(hub_, poses_, identity_, counters_, parsed_.lines.file()),
      clients_(io_, hub_, poses_, parsed_.config.limits, counters_, status_),
      metrics_(io_,
               [this] {
                 ipc::Status status;
                 status_.fill_status(status);
                 return prometheus_text(status);
               }),
      capture_(hub_),
      operator_({parsed_, load_keys(parsed_.config, parsed_.lines), hub_, poses_, names_, status_,
                 metrics_, capture_},
                std::move(load)),
      link_timer_(io_,
                  [this] {
                    if (hub_.give_up_on_dead_links()) watch_links();
                  }),
      copy_timer_(io_, [this] { hub_.send_copies(loop::now()); }),
      report_timer_(io_, [this] { answerer_->report(loop::now()); }) {
  status_.set_clients(clients_);
  status_.set_node_id_source(parsed_.config.node.id_source);
  clients_.operations = &operator_;
  open_stations(open);
  if (parsed_.config.reserved.report) start_answering();
}

Robot::~Robot() {
  clients_.close_all("swarmtalkd ends");
}

void Robot::start() {
  for (const auto& station : stations_) {
    station->start();
    log_of("link")->debug("link {}: {} on {}, {}", station->name(), station->link().type(),
                          station->link().device(), station->link().state());
  }
  metrics_.configure(parsed_.config.metrics);
  hub_.set_waiting_hook([this] { watch_links(); });
  hub_.set_copy_hook([this](Hub::Time at) { copy_timer_.at(at); });
}

void Robot::open_stations(const LinkOpener& open) {
  hub_.set_reserved(parsed_.config.reserved, how_to_change(parsed_));
  for (const LinkConfig& link : parsed_.config.links) {
    stations_.push_back(
        make_station(io_, link, parsed_.lines, identity_for(link), poses_, hub_, open));
    if (auto key = operator_.key_of(link.name)) {
      stations_.back()->link().set_freshness(link.checks_freshness);
      stations_.back()->link().set_also_key(operator_.also_key_of(link.name));
      stations_.back()->link().set_key(key);
    }
    hub_.add(*stations_.back());
    if (link.type == LinkType::kKilobot) add_kilobots(link, *stations_.back());
  }
  expect_one_to_start(stations_, parsed_.lines);
  if (const auto refusal = hub_.set_gateways(parsed_.config.gateways)) {
    throw parsed_.lines.error("gateway", refusal->text);
  }
}

void Robot::add_kilobots(const LinkConfig& link, Station& station) {
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
    head.received_at_ns = monotonic_ns();
    hub_.on_message(station, head,
                    {reinterpret_cast<const std::uint8_t*>(line.data()), line.size()});
  });
}

void Robot::start_answering() {
  answerer_.emplace(hub_, identity_, poses_, counters_, [this] {
    google::protobuf::RepeatedPtrField<ipc::ClientStatus> clients;
    clients_.fill(clients);
    std::vector<std::string> names;
    for (const ipc::ClientStatus& client : clients) names.push_back(client.name());
    return names;
  });
  answerer_->set_name(parsed_.config.node.name);
  answerer_->set_hook([this](Answerer::Time at) { report_timer_.at(at); });
  if (const auto refusal = answerer_->start()) {
    log_of("daemon")->info("this robot reports to nobody (report under [reserved]): {}",
                           refusal->text);
  }
  ping_answerer_.emplace(hub_, identity_, counters_);
  pings_.emplace(loop::Loop::of(io_), [this] { ping_answerer_->answer(); });
  ping_answerer_->set_hook([this] { pings_->at_end(); });
  if (const auto refusal = ping_answerer_->start()) {
    log_of("daemon")->info("this robot answers no ping (report under [reserved]): {}",
                           refusal->text);
  }
}

NodeIdentity& Robot::identity_for(const LinkConfig& link) {
  const auto own = own_ids(parsed_.config, link);
  if (!own && !link.node_id) return identity_;
  const NodeIdRange range = own ? NodeIdRange{own->least, own->most} : NodeIdRange{};
  link_identities_.push_back(
      std::make_unique<NodeIdentity>(link.node_id, range, identity_.epoch()));
  return *link_identities_.back();
}

// Runs only while messages wait: an idle daemon does not wake up.
void Robot::watch_links() {
  if (!link_timer_.is_armed()) link_timer_.after(kLinkWatchPeriod);
}

std::string Robot::status_line() const {
  std::string text = "node " + std::to_string(identity_.id());
  for (const auto& station : stations_) {
    text += ", link " + station->name() + " " + (station->is_up() ? "up" : station->link().state());
  }
  const std::size_t clients = clients_.size();
  return text + ", " + std::to_string(clients) + (clients == 1 ? " client" : " clients");
}

}  // namespace swarmtalk::daemon
