#include "tests/virtual/check/actor.hpp"

#include <utility>

namespace swarmtalk::test {
namespace {

constexpr std::size_t kPacketBytes = 1000;  // of a message: it surely fits into one packet

Policy policy_of(const ProgramPlan& plan) {
  Policy policy = Policy::last(plan.keeps);
  if (plan.wants == Wants::kNewestOfEach) policy = Policy::latest_from_each();
  if (plan.wants == Wants::kFresh) return policy.no_older_than(plan.max_age);
  return policy;
}

}  // namespace

Actor::Actor(VirtualProgram& program, Place place, const ProgramPlan& plan, Record& record,
             const std::unordered_map<std::string, int>& known, const int& run)
    : client_(program.client()),
      place_(place),
      process_(++record.processes),
      plan_(plan),
      record_(record),
      known_(known),
      run_(run) {
  client_.on_error({});
  client_.on_disconnect([this](const Status&) { end_hearings(); });
  client_.on_reconnect([this] { begin_hearings(); });
  for (const int channel : plan.sends) publish(channel);
  for (const int channel : plan.hears) {
    subscribers_.push_back(
        client_.subscribe(channel_name(channel), policy_of(plan),
                          [this, channel](const Message& message) { hear(channel, message); }));
  }
  look_for_connection();
}

Actor::~Actor() {
  if (!has_left_) leave(false);
  client_.on_disconnect({});
  client_.on_reconnect({});
}

void Actor::leave(bool is_open) {
  if (!is_open) end_hearings();
  for (const auto& [channel, mouth] : publishers_) {
    Publishing& publishing = record_.publishings[mouth.index];
    publishing.answered = mouth.answers->all;
    publishing.unsent = mouth.is_whole ? mouth.answers->refused : 0;
    publishing.is_open = is_open;
  }
  has_left_ = true;
}

bool Actor::send(int channel, const std::string& text, std::uint32_t ttl) {
  const auto found = publishers_.find(channel);
  if (found == publishers_.end()) return false;
  if (!found->second.publisher.send(text, ttl).ok()) return false;
  ++record_.publishings[found->second.index].accepted;
  if (text.size() > kPacketBytes || plan_.copies > 1) found->second.is_whole = false;
  return true;
}

void Actor::look_for_connection() {
  if (hearings_.empty() && client_.is_connected()) begin_hearings();
}

void Actor::publish(int channel) {
  Sending sending = plan_.queue == Queue::kNewest       ? Sending::newest(3)
                    : plan_.queue == Queue::kOneAtATime ? Sending::one_at_a_time()
                                                        : Sending{};
  if (plan_.redundancy > 0) sending = sending.redundant(plan_.redundancy);
  if (plan_.copies > 1) sending = sending.repeated(plan_.copies);
  auto answers = std::make_shared<Answers>();
  const auto count = [answers](const Status& answer) {
    ++answers->all;
    // Of one that was on its way when the connection was lost nobody knows.
    if (!answer.ok() && answer.code() != StatusCode::kDisconnected) ++answers->refused;
  };
  publishers_[channel] = {
      client_.advertise(channel_name(channel), sending,
                        plan_.has_callback ? SentCallback(count) : SentCallback()),
      record_.publishings.size(), answers, true};
  record_.publishings.push_back(
      {place_.robot, place_.program, channel, 0, 0, 0, true, plan_.has_callback});
}

void Actor::begin_hearings() {
  if (has_left_) return;
  end_hearings();
  for (const int channel : plan_.hears) {
    hearings_[channel] = record_.hearings.size();
    const bool is_spared = plan_.keeps < 64 || plan_.wants != Wants::kAll;
    Hearing hearing;
    hearing.robot = place_.robot;
    hearing.program = place_.program;
    hearing.channel = channel;
    hearing.run = run_;
    hearing.process = process_;
    hearing.is_spared = is_spared;
    hearing.is_open = true;
    hearing.sent_before = record_.sent.size();
    record_.hearings.push_back(std::move(hearing));
  }
}

void Actor::end_hearings() {
  for (const auto& [channel, index] : hearings_) record_.hearings[index].is_open = false;
  hearings_.clear();
}

void Actor::hear(int channel, const Message& message) {
  if (has_left_) return;
  look_for_connection();
  const auto hearing = hearings_.find(channel);
  if (hearing == hearings_.end()) {
    record_.broken.push_back("a message came while there was no connection");
    return;
  }
  const auto sent = known_.find(message.payload);
  HeardMessage heard;
  heard.sent = sent == known_.end() ? -1 : sent->second;
  heard.text = message.payload.substr(0, 24);
  heard.sender = message.sender;
  heard.epoch = message.epoch;
  heard.number = message.message_number;
  heard.hops = message.hops;
  heard.is_local = message.local;
  heard.lost = message.lost_before.total();
  heard.late = message.lost_before.late;
  heard.received_at = message.received_at;
  record_.hearings[hearing->second].heard.push_back(std::move(heard));
}

}  // namespace swarmtalk::test
