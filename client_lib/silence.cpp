#include "client_lib/silence.hpp"

#include <algorithm>

#include "loop/clock.hpp"
#include "text/nearest.hpp"

namespace swarmtalk::client {
namespace {

bool is_in_use(const ipc::ChannelStatus& channel) {
  return channel.publishers() > 0 || channel.received() > 0;
}

}  // namespace

void Silence::expect(std::shared_ptr<const SubscriberState> subscriber) {
  if (!is_over_ && expected_.size() < kMostExpected) expected_.push_back(std::move(subscriber));
}

void Silence::watch() {
  if (is_over_ || expected_.empty()) return;
  const auto now = loop::now();
  if (!deadline_) {
    deadline_ = now + patience_;
    wakeup_.set_timer(*deadline_);  // which nothing else uses while there is a connection
  }
  if (now >= *deadline_) ask();
}

Silence::Subscribers Silence::expected(bool silent) const {
  Subscribers found;
  for (const auto& each : expected_) {
    auto subscriber = each.lock();
    if (!subscriber || subscriber->is_closed || (silent && subscriber->has_heard)) continue;
    found.push_back(std::move(subscriber));
  }
  return found;
}

void Silence::ask() {
  is_over_ = true;
  if (expected(true).empty()) return;
  requests_.make().mutable_get_status();
  requests_.send([this](const ipc::Envelope* reply, const Status&) {
    if (has_ended_ || (reply != nullptr && tell_misspelt(reply->status()))) return;
    ask_who_is_around();
  });
}

void Silence::ask_who_is_around() {
  requests_.make().mutable_get_neighbours();
  requests_.send([this](const ipc::Envelope* reply, const Status&) {
    if (reply != nullptr && !has_ended_) tell_alone(reply->neighbours());
  });
}

bool Silence::tell_misspelt(const ipc::Status& daemon) const {
  const Subscribers ours = expected(false);
  std::vector<std::string> names;
  for (const auto& channel : daemon.channels()) {
    const bool is_ours = std::any_of(ours.begin(), ours.end(), [&](const auto& each) {
      return each->key->name == channel.name();
    });
    if (!channel.name().empty() && !is_ours) names.push_back(channel.name());
  }
  for (const auto& subscriber : expected(true)) {
    const std::string& name = subscriber->key->name;
    const bool is_known = std::any_of(
        daemon.channels().begin(), daemon.channels().end(),
        [&](const auto& channel) { return channel.name() == name && is_in_use(channel); });
    if (name.empty() || is_known) continue;
    const std::string near = text::nearest_channel(name, names);
    if (near.empty()) continue;
    tell_("nothing was heard on " + subscriber->key->label +
          ": nobody publishes it as far as this robot knows; did you mean '" + near + "'?");
    return true;
  }
  return false;
}

void Silence::tell_alone(const ipc::Neighbours& around) const {
  const Subscribers silent = expected(true);
  if (silent.empty() || silent.size() < expected(false).size()) return;  // something was heard
  const auto& robots = around.neighbours();
  const bool is_alone = std::all_of(robots.begin(), robots.end(),
                                    [](const auto& each) { return each.out_of_range(); });
  if (!is_alone) return;
  tell_("nothing was heard on " + silent.front()->key->label +
        ": no other robot is around, and a program does not hear itself; swarmtalk-cli "
        "neighbours shows who is heard, swarmtalk-cli doctor what is wrong");
}

}  // namespace swarmtalk::client
