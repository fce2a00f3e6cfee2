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
constexpr auto kLongReading = std::chrono::milliseconds(10);
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
      timer_(io),
      pause_(io),
      listening_(client_, [this](const Message& message) { take_message(message, now()); }) {
  client_.on_disconnect([this](const Status& status) {
    lost_daemon_at_ = Clock::now();
    std::fprintf(stderr, "swarmtalk-view: %s\n", std::string(status.text()).c_str());
  });
  client_.on_error([](const Status& status) {
    // Listening tells which channels are refused, and the page.
    if (status.code() == StatusCode::kBadChannel || status.code() == StatusCode::kLimit ||
        status.code() == StatusCode::kChannelConflict) {
      return;
    }
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
      [this](const Message& m) {
        traffic_.note_message(m, now());
        take_line(m.sender, m.payload, now());
      },
      Policy::last(kMessagesThatWait));
  harvest_ = client_.channel("harvest").subscriber(
      [this](const Message& m) {
        traffic_.note_message(m, now());
        take_harvest(m, now());
      },
      Policy::last(kMessagesThatWait));
  asker_ = client_.channel("harvest").publisher([](const Status&) {}, Sending::newest(1));
  for (const std::string& name : options_.channels) {
    if (const Status status = listening_.keep(name); !status) {
      return Status(status.code(), "--channel " + name + ": " + std::string(status.text()));
    }
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
                         if (Clock::now() < rest_until_) return rest();
                         const Time begin = Clock::now();
                         static_cast<void>(client_.process());
                         note_reading(begin);
                         wait_readable();
                       });
}

// A flood is read at most half the time: the pages are written in the other half.
void Observer::note_reading(Time begin) {
  const Time end = Clock::now();
  if (end - begin >= kLongReading) rest_until_ = end + (end - begin);
}

void Observer::rest() {
  pause_.expires_at(rest_until_);
  pause_.async_wait([this](const boost::system::error_code& error) {
    if (!error) wait_readable();
  });
}

void Observer::wait_tick() {
  const Clock::duration period = is_watched_ ? Clock::duration(kLookPeriod) : kIdlePeriod;
  timer_.expires_at(std::max(Clock::now() + period, rest_until_));
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error) tick();
  });
}

void Observer::tick() {
  const Time now = Clock::now();
  static_cast<void>(client_.process());
  if (client_.is_connected()) {
    if (now - status_asked_at_ >= kStatusPeriod) ask_status(now);
    look(now);
    std::vector<Neighbour> neighbours;
    if (client_.get_neighbours(neighbours)) swarm_.note_neighbours(neighbours, Clock::now());
    static_cast<void>(client_.process());
  }
  swarm_.forget_old(now);
  note_reading(now);
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
  std::set<std::uint16_t> own;
  for (const auto& [name, sender] : senders_) {
    if (const auto number = sender.publisher.channel_number()) own.insert(*number);
  }
  std::set<std::uint16_t> reserved;
  for (const Subscriber* each : {&debug_, &harvest_}) {
    if (const auto number = each->channel_number()) reserved.insert(*number);
  }
  listening_.note_status(status_, own, reserved, now);
  for (const auto& [name, subscriber] :
       {std::pair("debug", &debug_), std::pair("harvest", &harvest_)}) {
    if (is_refused(subscriber->status())) listening_.leave_out(name, subscriber->status());
  }
}

Status Observer::make_publisher(const std::string& channel) {
  if (senders_.size() >= kMostPublishers) {
    const auto is_older = [](const auto& one, const auto& other) {
      return one.second.used_at < other.second.used_at;
    };
    senders_.erase(std::min_element(senders_.begin(), senders_.end(), is_older));
  }
  const Channel opened = is_channel_number(channel) ? client_.channel(std::atoi(channel.c_str()))
                                                    : client_.channel(channel);
  Publisher publisher = opened.publisher([](const Status&) {});
  if (const Status status = publisher.status(); !status) return status;
  senders_[channel].publisher = std::move(publisher);
  return Status();
}

Status Observer::publish(const std::string& channel, const std::string& payload) {
  if (!senders_.contains(channel)) {
    if (const Status status = make_publisher(channel); !status) return status;
  }
  Sender& sender = senders_[channel];
  sender.used_at = Clock::now();
  return sender.publisher.send(payload);
}

}  // namespace swarmtalk::view
