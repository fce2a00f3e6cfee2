#include "cli/look/all_channels.hpp"

#include "cli/common/commands.hpp"
#include "text/counted.hpp"

namespace swarmtalk::cli {
namespace {

constexpr std::chrono::seconds kAskAgain{1};
constexpr std::chrono::seconds kTryAgain{10};  // what was refused

}  // namespace

AllChannels::AllChannels(Client& client, std::string socket_path, Policy policy, Receive receive)
    : client_(client),
      socket_path_(std::move(socket_path)),
      policy_(policy.looking_on()),
      receive_(std::move(receive)),
      air_(socket_path_) {}

Status AllChannels::start() {
  ask();
  return air_.open();
}

std::vector<int> AllChannels::fds() const {
  std::vector<int> all{air_.fd()};
  for (const auto& client : more_) all.push_back(client->fd());
  return all;
}

std::string AllChannels::left_out_text() const {
  if (left_out_.empty()) return {};
  return text::counted(left_out_.size(), "channel") + " left out";
}

void AllChannels::look() {
  for (const auto& client : more_) client->process().ok();
  if (Clock::now() >= next_) {
    ask();
    if (air_.fd() < 0) air_.open().ok();  // the client tells of a daemon that is away
  }
  air_.look().ok();  // the same
  for (const auto& [number, channel] : air_.channels()) {
    if (!subscribers_.contains(number)) subscribe(number, channel.is_timestamped);
  }
  if (air_.sealed_frames() > 0 && !is_sealed_told_) {
    is_sealed_told_ = true;
    fail(
        "frames are sealed with a swarm key, so channels are found only when a program of this "
        "robot uses them; name the others");
  }
}

void AllChannels::ask() {
  next_ = Clock::now() + kAskAgain;
  DaemonStatus daemon;
  if (!client_.get_status(daemon)) return;
  for (const ChannelStatus& channel : daemon.channels) {
    if (!channel.name.empty()) names_[channel.number] = channel.name;
    const bool is_looked_at_only = channel.onlookers > 0 && channel.publishers == 0 &&
                                   channel.subscribers == channel.onlookers;
    if (is_looked_at_only) continue;
    if (!subscribers_.contains(channel.number)) subscribe(channel.number, std::nullopt);
  }
}

std::string AllChannels::name_of(std::uint16_t number) const {
  const auto found = names_.find(number);
  return found == names_.end() ? std::to_string(number) : found->second;
}

Client* AllChannels::add_client() {
  if (more_.size() >= kMostMore) return nullptr;
  Common common;
  common.socket_path = socket_path_;
  auto client = std::make_unique<Client>(make_client(common));
  if (!client->connect()) return nullptr;
  more_.push_back(std::move(client));
  return more_.back().get();
}

Status AllChannels::subscribe_with(Client& client, std::uint16_t number,
                                   const ChannelOptions& options) {
  auto receive = [this, number](const Message& message) { receive_(name_of(number), message); };
  Subscriber subscriber = client.channel(number, options).subscriber(receive, policy_);
  const Status status = subscriber.status();
  if (status || status.code() == StatusCode::kDisconnected) {
    subscribers_.emplace(number, std::move(subscriber));
    return Status();
  }
  return status;
}

void AllChannels::subscribe(std::uint16_t number, std::optional<bool> is_timestamped) {
  const auto refused = refused_.find(number);
  if (refused != refused_.end() && Clock::now() < refused->second) return;
  ChannelOptions options;
  // As its packets are, so that a program that comes later is not refused for what we said.
  if (is_timestamped == true) options.timestamped = true;
  Status status = subscribe_with(client_, number, options);
  for (std::size_t i = 0; status.code() == StatusCode::kLimit && i < more_.size(); ++i) {
    status = subscribe_with(*more_[i], number, options);
  }
  if (status.code() == StatusCode::kLimit) {
    if (Client* const another = add_client()) {
      status = subscribe_with(*another, number, options);
      if (!status) more_.pop_back();
    }
  }
  if (status) {
    if (refused != refused_.end()) fail("channel " + name_of(number) + " is heard from now on");
    refused_.erase(number);
    return;
  }
  refused_[number] = Clock::now() + kTryAgain;
  if (!left_out_.insert(number).second) return;
  fail("channel " + name_of(number) + " is left out: " + std::string(status.text()));
}

}  // namespace swarmtalk::cli
