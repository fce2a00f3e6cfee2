#include "cli/look/all_channels.hpp"

#include "cli/common/commands.hpp"

namespace swarmtalk::cli {
namespace {

constexpr std::chrono::seconds kAskAgain{1};

}  // namespace

AllChannels::AllChannels(Client& client, std::string socket_path, Policy policy, Receive receive)
    : client_(client),
      policy_(policy),
      receive_(std::move(receive)),
      air_(std::move(socket_path)) {}

Status AllChannels::start() {
  ask();
  return air_.open();
}

void AllChannels::look() {
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
    if (!subscribers_.contains(channel.number)) subscribe(channel.number, std::nullopt);
  }
}

std::string AllChannels::name_of(std::uint16_t number) const {
  const auto found = names_.find(number);
  return found == names_.end() ? std::to_string(number) : found->second;
}

void AllChannels::subscribe(std::uint16_t number, std::optional<bool> is_timestamped) {
  if (refused_.contains(number)) return;
  ChannelOptions options;
  // As its packets are, so that a program that comes later is not refused for what we said.
  if (is_timestamped == true) options.timestamped = true;
  auto receive = [this, number](const Message& message) { receive_(name_of(number), message); };
  Subscriber subscriber = client_.channel(number, options).subscriber(receive, policy_);
  const Status status = subscriber.status();
  if (!status && status.code() != StatusCode::kDisconnected) {
    refused_.insert(number);
    fail("channel " + name_of(number) + " is left out: " + std::string(status.text()));
    return;
  }
  subscribers_.emplace(number, std::move(subscriber));
}

}  // namespace swarmtalk::cli
