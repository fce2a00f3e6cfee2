#include "daemon/answer/answerer.hpp"

#include <string_view>

#include "daemon/station/node_identity.hpp"
#include "loop/chance.hpp"
#include "loop/clock.hpp"
#include "report/harvest_text.hpp"

namespace swarmtalk::daemon {

Answerer::Answerer(Hub& hub, const NodeIdentity& identity, const PoseKeeper& poses,
                   DaemonCounters& counters, std::function<std::vector<std::string>()> programs)
    : identity_(identity),
      counters_(counters),
      record_(hub, poses, std::move(programs)),
      gatherer_(loop::random_bits()),
      channel_(hub) {
  channel_.publisher().is_daemons_own = true;
}

std::optional<Refusal> Answerer::start() {
  return channel_.open("harvest", *this);
}

// Reports are heard from their transmitter alone: one hop, and across no gateway.
void Answerer::on_message(Subscription&, const MessageRef& message) {
  const std::string_view bytes = message->payload;
  const Time now = loop::now();
  if (message->is_local && report::is_look(bytes)) {
    if (const auto look = report::decode_look(bytes)) {
      gatherer_.on_look(identity_.id(), *look, record_.neighbours(now), now);
    } else {
      ++counters_.reports_unreadable;
    }
    return plan();
  }
  if (message->is_local && question_ != 0 && report::question_of_answer(bytes) == question_) {
    report::decode_answer(bytes, [this](std::string_view key, std::string_view value) {
      record_.note_value(key, value);
    });
    return;
  }
  if (message->is_local || !report::is_report(bytes)) return;
  const auto report = report::decode_report(bytes);
  if (!report || message->hops != 0 || message->crossed_gateway) {
    ++counters_.reports_unreadable;
    return;
  }
  ++counters_.reports_received;
  gatherer_.on_report(identity_.id(), message->sender, *report, bytes.size(),
                      record_.neighbours(now), now);
  plan();
}

void Answerer::plan() {
  const std::optional<Time> due = gatherer_.due();
  if (!due || due == told_) return;
  told_ = due;
  hook_(*due);
}

void Answerer::report(Time now) {
  told_.reset();
  if (gatherer_.due() && *gatherer_.due() <= now) {
    const std::size_t neighbours = record_.neighbours(now);
    const bool is_wanted = gatherer_.is_wanted(identity_.id(), now);
    const std::string body = record_.body(is_wanted, now);
    if (is_wanted) {
      ask_programs(now);
    } else if (asked_at_) {
      record_.forget_values();
      asked_at_.reset();
    }
    const std::size_t most = channel_.message_bytes();
    if (const auto bytes = gatherer_.report(identity_.id(), body, neighbours, most, now)) {
      // One that a link that is down, or has the last one still, does not take is not missed.
      if (!channel_.publish(*bytes)) ++counters_.reports_sent;
    }
  }
  plan();
}

// What its programs have set for whoever asks (Harvest of the client library): they are asked here,
// not over the air, and their answers travel one hop; the next report tells them.
void Answerer::ask_programs(Time now) {
  if (asked_at_ && now - *asked_at_ < kAskPeriod) return;
  asked_at_ = now;
  do {
    question_ = loop::random_bits();
  } while (question_ == 0);
  record_.begin_values();
  channel_.tell_programs(report::encode(report::HarvestQuestion{question_, 0, ""}));
}

}  // namespace swarmtalk::daemon
