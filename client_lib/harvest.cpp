#include "swarmtalk/client/harvest.hpp"

#include <algorithm>

#include "loop/chance.hpp"
#include "report/harvest_text.hpp"

namespace swarmtalk {
namespace {

constexpr std::size_t kAnswerBytes = 1000;  // of one message; more values go into more messages
constexpr std::uint32_t kAnswersThatWait = 16;

Channel harvest_channel(Client& client) {
  return client.channel("harvest");
}

Status bad(std::string text) {
  return Status(StatusCode::kBadArgument, std::move(text));
}

}  // namespace

// What the daemon refuses for its rate is counted there; the question is simply asked again.
Harvest::Harvest(Client& client)
    : publisher_(harvest_channel(client).publisher([](const Status&) {},
                                                   Sending::newest(kAnswersThatWait))),
      subscriber_(
          harvest_channel(client).subscriber([this](const Message& message) { hear(message); })) {}

Status Harvest::status() const {
  Status publishing = publisher_.status();
  return publishing ? subscriber_.status() : publishing;
}

Status Harvest::set(std::string_view key, std::string_view value) {
  if (key.empty() || key.size() > kMaxKeyBytes) {
    return bad("the key of a value has 1 to " + std::to_string(kMaxKeyBytes) + " bytes, not " +
               std::to_string(key.size()));
  }
  if (value.size() > kMaxValueBytes) {
    return bad("a value has at most " + std::to_string(kMaxValueBytes) + " bytes, not " +
               std::to_string(value.size()));
  }
  const auto found = values_.find(key);
  if (found != values_.end()) {
    found->second = value;
    return Status();
  }
  if (values_.size() >= kMaxValues) {
    return bad("a program sets at most " + std::to_string(kMaxValues) + " values; remove one");
  }
  values_.emplace(key, value);
  return Status();
}

void Harvest::remove(std::string_view key) {
  if (const auto found = values_.find(key); found != values_.end()) values_.erase(found);
}

Status Harvest::ask(std::string_view prefix, Callback found, std::uint32_t ttl) {
  do {
    question_ = loop::random_bits();
  } while (question_ == 0);
  found_ = std::move(found);
  const auto answer_ttl = static_cast<std::uint8_t>(std::min<std::uint32_t>(ttl, UINT8_MAX));
  return publisher_.send(report::encode({question_, answer_ttl, prefix}), ttl);
}

void Harvest::hear(const Message& message) {
  if (const auto question = report::decode_question(message.payload)) {
    return answer(question->number, question->ttl, question->prefix);
  }
  if (question_ == 0 || !found_) return;
  HarvestedValue value;
  value.node_id = message.sender;
  value.epoch = message.epoch;
  value.hops = message.hops;
  value.local = message.local;
  const Callback found = found_;  // which may ask again
  report::decode_answer(message.payload, question_,
                        [&](std::string_view key, std::string_view content) {
                          value.key = key;
                          value.value = content;
                          found(value);
                        });
}

void Harvest::answer(std::uint32_t question, std::uint32_t ttl, std::string_view prefix) {
  const std::string empty = report::begin_answer(question);
  std::string bytes = empty;
  const std::size_t most = std::min(kAnswerBytes, publisher_.max_message_bytes());
  for (auto each = values_.lower_bound(prefix); each != values_.end(); ++each) {
    if (!each->first.starts_with(prefix)) break;
    std::string with_it = bytes;
    report::append_value(with_it, each->first, each->second);
    if (with_it.size() > most && bytes.size() > empty.size()) {
      static_cast<void>(publisher_.send(bytes, ttl));
      with_it = empty;
      report::append_value(with_it, each->first, each->second);
    }
    bytes = std::move(with_it);
  }
  if (bytes.size() > empty.size()) static_cast<void>(publisher_.send(bytes, ttl));
}

}  // namespace swarmtalk
