#include <algorithm>
#include <map>
#include <set>

#include "cli/common/checks.hpp"
#include "cli/common/commands.hpp"
#include "cli/common/deadline.hpp"
#include "cli/recording/recording.hpp"
#include "recording/recording_reader.hpp"
#include "recording/time_order.hpp"
#include "text/nearest.hpp"

namespace swarmtalk::cli {
namespace {

using recording::Record;
using recording::RecordingReader;

constexpr std::chrono::milliseconds kAskPeriod{200};
constexpr std::chrono::minutes kToldGap{1};
constexpr std::chrono::seconds kQuietWait{3};  // then it is told what is waited for
constexpr std::chrono::milliseconds kBusyPause{2};
// What robots say on it is of that moment: their reports, and questions that would be answered.
constexpr const char* kHarvest = "harvest";
constexpr const char* kDebug = "debug";

/// Publishes the messages of one recording, each at its time.
class Player {
 public:
  Player(Client& client, const PlayArguments& arguments) : client_(client), arguments_(arguments) {}

  /// Looks through the recording for the channels that it has, and opens them.
  /// @return why not, or that there is nothing to play
  Status prepare(RecordingReader& reader) {
    find_numbers();
    std::vector<std::string> unheard = arguments_.channels;
    const auto look = [this](const Record& each) {
      if (is_left_out(each)) ++harvested_;
      if (each.kind == Record::Kind::kHeard) names_.insert(each.heard.channel());
      return wants(each);
    };
    recording::TimeOrder records(reader, look);
    Record record;
    while (records.next(record)) {
      ++messages_;
      misplaced_.note(record.time_ns);
      std::erase_if(unheard, [&](const std::string& word) { return is_of(word, record); });
      bool& is_timestamped = channels_[record.heard.channel()];
      is_timestamped = is_timestamped || record.heard.has_buffering_delay_us();
    }
    if (harvested_ > 0) {
      fail(arguments_.file + ": " + std::to_string(harvested_) +
           (harvested_ == 1 ? " message of the channel harvest is"
                            : " messages of the channel harvest are") +
           " left out, since robots answer there for themselves; -c harvest plays them");
    }
    if (messages_ == 0) {
      return Status(StatusCode::kBadArgument,
                    arguments_.file + " has no messages" +
                        (arguments_.channels.empty() ? "" : " of these channels") +
                        (harvested_ > 0 ? " but those" : "") + nearest_text(unheard));
    }
    if (const std::string text = misplaced_.text("message"); !text.empty()) {
      fail(arguments_.file + ": " + text);
    }
    for (const std::string& word : unheard) {
      fail(arguments_.file + " has no messages of '" + word + "'" + nearest_text({word}));
    }
    for (const auto& [name, is_timestamped] : channels_) {
      if (is_digits(name) && name.size() > 5) {
        return Status(StatusCode::kBadChannel, arguments_.file + " names a channel " + name +
                                                   "; channel numbers go from 0 to 65535");
      }
      ChannelOptions options;
      options.ttl = arguments_.ttl;
      if (is_timestamped) options.timestamped = true;
      const auto sent = [this](const Status& status) {
        --waiting_;
        if (!status) note(status);
      };
      Publisher publisher = open_channel(client_, name, options).publisher(sent, Sending());
      if (const Status status = publisher.status(); !status) {
        const bool is_off = status.code() == StatusCode::kBadChannel && name == kDebug;
        if (!is_off || !arguments_.channels.empty()) return status;
        fail(arguments_.file +
             ": lines of the channel debug are left out: " + std::string(status.text()));
        is_debug_off_ = true;
        continue;
      }
      publishers_.emplace(name, std::move(publisher));
    }
    return Status();
  }

  /// Until somebody is there. @return false: a signal came first
  bool wait_for_listener() {
    const auto patience = Clock::now() + kQuietWait;
    for (bool is_told = false;;) {
      if (!is_told && Clock::now() >= patience) {
        is_told = true;
        fail(
            "waiting: no other robot is heard, and no program here subscribes to what is played; a "
            "robot whose programs send nothing is heard only with beacon_ms in its configuration");
      }
      if (caught_signal() != 0) return false;
      std::vector<Neighbour> neighbours;
      DaemonStatus daemon;
      if (client_.get_neighbours(neighbours) && !neighbours.empty()) return true;
      if (client_.get_status(daemon)) {
        for (const ChannelStatus& channel : daemon.channels) {
          const bool is_ours = publishers_.contains(channel.name) ||
                               publishers_.contains(std::to_string(channel.number));
          if (is_ours && channel.subscribers > channel.onlookers) return true;
        }
      }
      client_.run_for(kAskPeriod);
    }
  }

  /// Once through. @return false: a signal came, or it cannot go on
  bool play(RecordingReader& reader) {
    recording::TimeOrder records(reader, [this](const Record& each) { return wants(each); });
    Record record;
    std::optional<std::uint64_t> first_ns;
    const auto start = Clock::now();
    while (records.next(record)) {
      if (!first_ns) first_ns = record.time_ns;
      const auto offset_ns =
          static_cast<double>(record.time_ns - std::min(*first_ns, record.time_ns));
      const auto due = after(start, seconds(offset_ns / 1e9 / arguments_.rate));
      if (due - Clock::now() > kToldGap) tell_gap(due - Clock::now());
      if (!run_until(due) || !keep_order(record) || !publish(record)) return false;
    }
    return true;
  }

  /// Waits until what was handed over has left, at most 5 s.
  void drain() {
    const auto end = Clock::now() + std::chrono::seconds(5);
    while (waiting_ > 0 && caught_signal() == 0 && Clock::now() < end) {
      client_.run_once(end - Clock::now());
    }
    not_sent_ += waiting_;
  }

  std::uint64_t played() const { return played_; }
  std::uint64_t not_sent() const { return not_sent_; }
  const Status& failure() const { return failure_; }

 private:
  bool is_left_out(const Record& record) const {
    return record.kind == Record::Kind::kHeard && arguments_.channels.empty() &&
           record.heard.channel() == kHarvest;
  }

  /// Numbers of the chosen names: what no program there had named is recorded by its number.
  void find_numbers() {
    for (const std::string& word : arguments_.channels) {
      if (is_digits(word)) continue;
      const Publisher asking = client_.channel(word).publisher();
      if (const auto number = asking.channel_number()) numbers_[word] = *number;
    }
  }

  /// What the first misspelt of these channels may have been, to be put after a sentence.
  std::string nearest_text(const std::vector<std::string>& words) const {
    for (const std::string& word : words) {
      const std::string near = text::nearest_channel(word, {names_.begin(), names_.end()});
      if (!near.empty()) return "; did you mean '" + near + "'?";
    }
    return {};
  }

  bool wants(const Record& record) const {
    if (record.kind != Record::Kind::kHeard || is_left_out(record)) return false;
    if (is_debug_off_ && record.heard.channel() == kDebug) return false;
    const auto& chosen = arguments_.channels;
    return chosen.empty() ||
           std::any_of(chosen.begin(), chosen.end(),
                       [&](const std::string& word) { return is_of(word, record); });
  }

  /// Whether the message is of the channel with this name or number.
  bool is_of(const std::string& word, const Record& record) const {
    const std::uint32_t number = record.heard.channel_number();
    const auto named = numbers_.find(word);
    return word == record.heard.channel() || word == std::to_string(number) ||
           (named != numbers_.end() && named->second == number);
  }

  static void tell_gap(Clock::duration gap) {
    const auto whole = std::chrono::duration_cast<std::chrono::seconds>(gap).count();
    fail("nothing was recorded for the next " + std::to_string(whole) +
         " s, so nothing leaves; --rate makes it shorter, Ctrl-C ends it");
  }

  bool run_until(Clock::time_point due) {
    while (caught_signal() == 0 && Clock::now() < due) client_.run_once(due - Clock::now());
    return caught_signal() == 0;
  }

  /// Channels take turns in the daemon: another one's message goes when those before it have left.
  /// Waits for that at most 5 s, since a link may be down. @return false: a signal came
  bool keep_order(const Record& record) {
    const auto end = Clock::now() + std::chrono::seconds(5);
    const bool is_another = record.heard.channel() != last_channel_;
    last_channel_ = record.heard.channel();
    while (is_another && waiting_ > 0 && caught_signal() == 0 && Clock::now() < end) {
      client_.run_once(end - Clock::now());
    }
    return caught_signal() == 0;
  }

  /// Hands one message over; waits while the channel's queue is full. Nothing is left out.
  bool publish(const Record& record) {
    Publisher& publisher = publishers_[record.heard.channel()];
    for (;;) {
      const Status status = publisher.send(record.heard.payload());
      if (status.ok()) {
        ++waiting_;
        ++played_;
        return true;
      }
      const bool may_wait = status.code() == StatusCode::kBusy ||
                            status.code() == StatusCode::kDisconnected ||
                            status.code() == StatusCode::kRate;
      if (!may_wait) {
        note(status);
        return true;
      }
      if (!run_until(Clock::now() + kBusyPause)) return false;
    }
  }

  void note(const Status& status) {
    ++not_sent_;
    if (failure_.ok()) failure_ = status;
  }

  Client& client_;
  const PlayArguments& arguments_;
  std::set<std::string> names_;                   // of all channels in the file
  std::map<std::string, std::uint32_t> numbers_;  // of the channels chosen by name
  std::map<std::string, bool> channels_;          // and whether they are timestamped
  std::map<std::string, Publisher> publishers_;
  std::uint64_t messages_ = 0;
  recording::TimeOrder::Misplaced misplaced_{std::chrono::nanoseconds(0)};
  std::uint64_t harvested_ = 0;  // left out
  bool is_debug_off_ = false;    // its lines are left out
  std::uint64_t played_ = 0;
  std::uint64_t waiting_ = 0;
  std::string last_channel_;
  std::uint64_t not_sent_ = 0;
  Status failure_;
};

}  // namespace

int play(const Common& common, const PlayArguments& arguments) {
  RecordingReader reader;
  if (const std::string problem = reader.open(arguments.file); !problem.empty()) {
    return fail(problem);
  }
  Client client = make_client(common);
  if (const Status status = client.connect(); !status) return fail(status);
  stop_on_signals(client);
  tell_connection(client);
  Player player(client, arguments);
  const Status prepared = player.prepare(reader);
  if (const std::string problem = reader.problem(); !problem.empty()) {
    fail(arguments.file + ": " + problem);
  }
  if (!prepared) return fail(prepared);
  bool goes_on = !arguments.waits || player.wait_for_listener();
  while (goes_on) {
    reader.rewind();
    goes_on = player.play(reader) && arguments.is_looping;
  }
  player.drain();
  if (player.not_sent() > 0) {
    const std::string why(player.failure().ok() ? "they have not left in time"
                                                : player.failure().text());
    fail(std::to_string(player.not_sent()) + " of " + std::to_string(player.played()) +
         (player.played() == 1 ? " message was" : " messages were") + " not sent: " + why);
    if (caught_signal() == 0) return kExitFailure;
  }
  return caught_signal() == 0 ? kExitOk : kExitSignal + caught_signal();
}

}  // namespace swarmtalk::cli
