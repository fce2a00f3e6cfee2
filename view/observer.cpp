#include "view/observer.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <utility>

namespace swarmtalk::view {
namespace {

constexpr auto kLookPeriod = std::chrono::milliseconds(100);  // while somebody looks
constexpr auto kIdlePeriod = std::chrono::seconds(1);
constexpr auto kAskPeriod = std::chrono::seconds(10);  // less than what is asked for
constexpr auto kAskPeriodOfDetails = std::chrono::seconds(2);
constexpr auto kStatusPeriod = std::chrono::seconds(1);
constexpr auto kAnswerWithin = std::chrono::milliseconds(300);
constexpr std::uint32_t kMessagesThatWait = 256;  // of one channel, while we are busy

ClientOptions client_options(const ObserverOptions& options) {
  ClientOptions made;
  made.socket_path = options.socket_path;
  made.request_timeout = kAnswerWithin;
  return made;
}

}  // namespace

Observer::Observer(boost::asio::io_context& io, ObserverOptions options)
    : options_(std::move(options)),
      client_("swarmtalk-view", client_options(options_)),
      readable_(io, client_.fd()),
      timer_(io) {
  client_.on_disconnect([this](const Status& status) {
    lost_daemon_at_ = Clock::now();
    std::fprintf(stderr, "swarmtalk-view: %s; trying again\n", std::string(status.text()).c_str());
  });
  client_.on_error([](const Status& status) {
    if (status.code() == StatusCode::kBadChannel) return;  // the page says so
    std::fprintf(stderr, "swarmtalk-view: %s\n", std::string(status.text()).c_str());
  });
  client_.on_reconnect([this] {
    lost_daemon_at_.reset();
    std::fprintf(stderr, "swarmtalk-view: connected to %s again\n", client_.daemon_name().c_str());
  });
}

Observer::~Observer() {
  readable_.release();  // the client's
}

Status Observer::start() {
  if (Status status = client_.connect(); !status) return status;
  debug_ = client_.channel("debug").subscriber(
      [this](const Message& m) { take_line(m.sender, m.payload, now()); },
      Policy::last(kMessagesThatWait));
  harvest_ = client_.channel("harvest").subscriber(
      [this](const Message& m) { take_harvest(m, now()); }, Policy::last(kMessagesThatWait));
  asker_ = client_.channel("harvest").publisher([](const Status&) {}, Sending::newest(1));
  for (const std::string& name : options_.channels) {
    if (!listen(name)) return Status(StatusCode::kBadChannel, "cannot listen to channel " + name);
  }
  tick();
  wait_readable();
  return Status();
}

std::uint64_t Observer::wall_ns() const {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::nanoseconds>(since_1970).count());
}

void Observer::wait_readable() {
  readable_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                       [this](const boost::system::error_code& error) {
                         if (error) return;
                         static_cast<void>(client_.process());
                         wait_readable();
                       });
}

void Observer::wait_tick() {
  if (is_watched_) {
    timer_.expires_after(kLookPeriod);
  } else {
    timer_.expires_after(kIdlePeriod);
  }
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error) tick();
  });
}

void Observer::tick() {
  static_cast<void>(client_.process());
  const Time now = Clock::now();
  if (client_.is_connected()) {
    if (now - status_asked_at_ >= kStatusPeriod) ask_status(now);
    look(now);
    std::vector<Neighbour> neighbours;
    if (client_.get_neighbours(neighbours)) swarm_.note_neighbours(neighbours, Clock::now());
    static_cast<void>(client_.process());
  }
  swarm_.forget_old(now);
  wait_tick();
}

// While somebody looks, the swarm is asked to report; it ends by itself when nobody does.
void Observer::look(Time now) {
  const auto period = reports_.has_new_wish() ? kAskPeriodOfDetails : kAskPeriod;
  if (!is_watched_ || now - looked_at_ < period || !asker_.status()) return;
  looked_at_ = now;
  static_cast<void>(static_cast<bool>(asker_.send(reports_.look())));
}

void Observer::ask_status(Time now) {
  status_asked_at_ = now;
  DaemonStatus status;
  if (!client_.get_status(status)) return;
  status_ = std::move(status);
  swarm_.note_self(status_, Clock::now());
  traffic_.note_status(status_);
  for (const ChannelStatus& channel : status_.channels) listen_to_number(channel.number);
}

Channel Observer::channel_called(const std::string& name) {
  return is_channel_number(name) ? client_.channel(std::atoi(name.c_str())) : client_.channel(name);
}

std::optional<std::uint16_t> Observer::listen(const std::string& name) {
  if (const auto found = named_.find(name); found != named_.end()) {
    return found->second.channel_number();
  }
  if (named_.size() + by_number_.size() >= Traffic::kMostChannels) return std::nullopt;
  Subscriber subscriber = channel_called(name).subscriber(
      [this](const Message& message) { take_message(message, now()); },
      Policy::last(kMessagesThatWait));
  const std::optional<std::uint16_t> number = subscriber.channel_number();
  const Status status = subscriber.status();
  if (!status && status.code() != StatusCode::kDisconnected) return std::nullopt;
  if (number) {
    by_number_.erase(*number);  // each channel once
    for (const auto& [other, held] : named_) {
      if (held.channel_number() == number) return number;
    }
    if (ChannelTraffic* const known = traffic_.channel(*number);
        known != nullptr && !is_channel_number(name)) {
      known->name = name;
    }
  }
  named_.emplace(name, std::move(subscriber));
  return number;
}

void Observer::listen_to_number(std::uint16_t number) {
  if (number == debug_.channel_number() || number == harvest_.channel_number()) return;
  if (by_number_.contains(number)) return;
  if (named_.size() + by_number_.size() >= Traffic::kMostChannels) return;
  for (const auto& [name, held] : named_) {
    if (held.channel_number() == number) return;
  }
  by_number_.emplace(
      number, client_.channel(static_cast<int>(number))
                  .subscriber([this](const Message& message) { take_message(message, now()); },
                              Policy::last(kMessagesThatWait)));
}

Status Observer::publish(const std::string& channel, const std::string& payload) {
  auto found = publishers_.find(channel);
  if (found == publishers_.end()) {
    if (publishers_.size() >= kMostPublishers) {
      return Status(StatusCode::kLimit, "at most " + std::to_string(kMostPublishers) +
                                            " channels can be sent on; start swarmtalk-view again");
    }
    Publisher publisher = channel_called(channel).publisher([](const Status&) {});
    if (const Status status = publisher.status(); !status) return status;
    found = publishers_.emplace(channel, std::move(publisher)).first;
  }
  return found->second.send(payload);
}

}  // namespace swarmtalk::view
