#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <memory>
#include <set>
#include <vector>

#include "cli/common/clock.hpp"
#include "cli/common/commands.hpp"
#include "cli/common/deadline.hpp"
#include "cli/common/link_watch.hpp"
#include "cli/common/quiet_watch.hpp"
#include "cli/look/all_channels.hpp"
#include "cli/recording/recording.hpp"
#include "cli/recording/scene.hpp"
#include "cli/text/format.hpp"
#include "recording/recorder.hpp"
#include "text/counted.hpp"
#include "text/plain.hpp"

namespace swarmtalk::cli {
namespace {

constexpr std::chrono::seconds kSurveyPeriod{1};
constexpr const char* kLogChannel = "debug";

/// Where records go: an MCAP file, or lines on standard output.
class Output {
 public:
  std::string open(const RecordArguments& arguments) {
    if (arguments.is_jsonl) return {};
    recorder_.emplace();
    return recorder_->open(arguments.file, "swarmtalk-cli " SWARMTALK_VERSION, arguments.replaces);
  }

  void heard(const std::string& channel, const Message& message) {
    const auto at = message.received_at.value_or(Clock::now());
    if (recorder_) {
      recorder_->heard(channel, message, at);
      scene_.note(message, at);
    } else {
      line("message", at, to_json(channel, message));
    }
  }
  void log_line(const Message& message) {
    const auto at = message.received_at.value_or(Clock::now());
    if (recorder_) {
      recorder_->log_line(message, at);
      Scene::write_log(*recorder_, message, at);
    } else {
      line("log", at, to_json(kLogChannel, message));
    }
  }
  void survey(const DaemonStatus& daemon, const std::vector<Neighbour>& neighbours) {
    const auto now = Clock::now();
    if (recorder_) {
      recorder_->own_pose(daemon.node_id, daemon.pose, now);
      for (const Neighbour& each : neighbours) recorder_->neighbour(each, now);
      for (const ChannelStatus& each : daemon.channels) recorder_->losses(each, now);
      scene_.note(daemon, neighbours, now);
      scene_.draw(*recorder_, now);
      return;
    }
    line("pose", now, {{"node_id", daemon.node_id}, {"pose", to_json(daemon.pose)}});
    line("neighbours", now, to_json(neighbours));
    Json channels = Json::array();
    for (const ChannelStatus& each : daemon.channels) {
      channels.push_back({{"number", each.number},
                          {"name", each.name},
                          {"received", each.received},
                          {"lost", to_json(each.lost)}});
    }
    line("losses", now, {{"channels", channels}});
  }

  bool has_scene() const { return recorder_.has_value(); }
  void look(const std::vector<Neighbour>& neighbours) {
    const auto now = Clock::now();
    scene_.note(neighbours, now);
    scene_.draw(*recorder_, now);
  }

  void tick() {
    if (const auto step = clock_.was_set()) tell_step(*step);
    if (recorder_) recorder_->tick(Clock::now());
  }
  Clock::time_point next() const {
    return recorder_ ? recorder_->next_close() : Clock::time_point::max();
  }
  bool is_good() const { return recorder_ ? recorder_->problem().empty() : written_ == kExitOk; }

  /// Ends the recording. @return the exit code: of a failure that has been told
  int finish(const std::string& path, const std::string& summary) {
    if (!recorder_) return written_;
    scene_.draw_last(*recorder_, Clock::now());
    recorder_->finish();
    const auto& writer = recorder_->writer();
    if (!recorder_->problem().empty()) {
      return fail(recorder_->problem() +
                  "; the recording is readable up to its last whole chunk, " +
                  text::counted(writer.messages(), "record") + ", and " +
                  std::to_string(writer.lost_messages()) + " after it are lost");
    }
    std::string slow;  // meanwhile nothing is read from the daemon
    const auto longest = std::chrono::round<std::chrono::seconds>(writer.longest_write());
    if (longest.count() > 0)
      slow = "; the disk took " + std::to_string(longest.count()) + " s once";
    return print(text::plain(path) + ": " + summary + ", " + std::to_string(writer.size_bytes()) +
                 " bytes" + slow + "\n");
  }

 private:
  void tell_step(std::chrono::nanoseconds by) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%+.3f s", static_cast<double>(by.count()) / 1e9);
    fail(std::string("this machine's clock was set by ") + text.data() +
         "; the recording goes on in the time that it began with");
    if (recorder_) recorder_->clock_was_set(by, Clock::now());
  }

  void line(const char* type, Clock::time_point at, const Json& content) {
    const std::uint64_t time_ns = clock_.ns(at);
    Json json{{"type", type}, {"time_ns", time_ns}};
    json.update(content);
    Json* const received =
        json.contains("received_at_unix_s") ? &json["received_at_unix_s"] : nullptr;
    if (received != nullptr && !received->is_null()) {  // a line has one clock
      *received = static_cast<double>(time_ns / 1000) / 1e6;
    }
    const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
    if (written_ == kExitOk) written_ = print(text);
  }

  std::optional<recording::Recorder> recorder_;
  recording::RecordClock clock_;
  Scene scene_;
  int written_ = kExitOk;
};

std::string utc_now() {
  const auto now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M UTC", &utc);
  return text.data();
}

class Recording {
 public:
  Recording(Client& client, const Common& common, const RecordArguments& arguments, Output& output)
      : client_(client),
        common_(common),
        arguments_(arguments),
        output_(output),
        quiet_(client, arguments.channels) {
    if (arguments.channels.empty()) quiet_.stop();  // of all channels none is misspelt
  }

  /// @return why nothing can be recorded
  Status start() {
    const Policy policy = Policy::last(1024);  // also while the disk is slow
    const auto receive = [this](const std::string& channel, const Message& message) {
      heard(channel, message);
    };
    log_ = client_.subscribe(kLogChannel, policy, [this](const Message& message) {
      if (!is_enough()) output_.log_line(message);
    });
    if (const Status status = log_.status(); !status) return status;
    if (arguments_.channels.empty()) {
      all_ = std::make_unique<AllChannels>(client_, common_.socket_path, policy, receive);
      return all_->start();
    }
    for (const std::string& word : arguments_.channels) {
      Subscriber subscriber =
          open_channel(client_, word, {})
              .subscriber([receive, word](const Message& m) { receive(word, m); }, policy);
      if (const Status status = subscriber.status(); !status) return status;
      if (is_new(subscriber, subscribers_)) subscribers_.push_back(std::move(subscriber));
    }
    return Status();
  }

  /// Until its end. @return false: nobody reads our output
  bool run() {
    LinkWatch links(client_);
    const auto end = arguments_.timeout_s > 0 ? after(Clock::now(), seconds(arguments_.timeout_s))
                                              : Clock::time_point::max();
    while (!is_enough() && output_.is_good() && caught_signal() == 0 && Clock::now() < end) {
      links.look();
      if (links.has_told()) quiet_.stop();
      quiet_.look();
      if (all_) all_->look();
      if (Clock::now() >= next_survey_) {
        survey();
      } else if (Clock::now() >= next_look_) {
        look();
      }
      output_.tick();
      auto next =
          std::min({end, links.next(), quiet_.next(), next_survey_, next_look_, output_.next()});
      if (all_) next = std::min(next, all_->next());
      if (!wait(next)) return false;
      client_.process();
    }
    return true;
  }

  std::string summary() const {
    std::string text =
        text::counted(heard_, "message") + " on " + text::counted(channels_.size(), "channel");
    if (all_ && !all_->left_out_text().empty()) text += ", " + all_->left_out_text();
    return lost_ ? text + ", lost " + loss_text(lost_) : text;
  }
  bool is_enough() const { return arguments_.count != 0 && heard_ == arguments_.count; }
  std::uint64_t heard() const { return heard_; }

 private:
  void heard(const std::string& channel, const Message& message) {
    quiet_.heard(channel);
    if (is_enough() || !output_.is_good()) return;
    ++heard_;
    lost_ += message.lost_before;
    channels_.insert(message.channel);
    output_.heard(channel, message);
  }

  void survey() {
    next_survey_ = Clock::now() + kSurveyPeriod;
    if (output_.has_scene()) next_look_ = Clock::now() + Scene::kPeriod;
    DaemonStatus daemon;
    std::vector<Neighbour> neighbours;
    if (client_.get_status(daemon) && client_.get_neighbours(neighbours)) {
      output_.survey(daemon, neighbours);
    }
  }

  void look() {
    next_look_ = Clock::now() + Scene::kPeriod;
    std::vector<Neighbour> neighbours;
    if (client_.get_neighbours(neighbours)) output_.look(neighbours);
  }

  bool wait(Clock::time_point until) const {
    using std::chrono::milliseconds;
    const auto left = std::chrono::ceil<milliseconds>(until - Clock::now());
    const auto wait = std::clamp<milliseconds>(left, milliseconds(0), std::chrono::hours(1));
    const int out = arguments_.is_jsonl ? STDOUT_FILENO : -1;
    std::vector<pollfd> descriptors{{out, 0, 0}, {client_.fd(), POLLIN, 0}};
    for (const int fd : all_ ? all_->fds() : std::vector<int>()) {
      descriptors.push_back({fd, POLLIN, 0});
    }
    const int count =
        ::poll(descriptors.data(), descriptors.size(), static_cast<int>(wait.count()));
    return count <= 0 || (descriptors[0].revents & POLLERR) == 0;
  }

  Client& client_;
  const Common& common_;
  const RecordArguments& arguments_;
  Output& output_;
  QuietWatch quiet_;
  Subscriber log_;
  std::vector<Subscriber> subscribers_;
  std::unique_ptr<AllChannels> all_;
  std::set<std::uint16_t> channels_;
  std::uint64_t heard_ = 0;
  Loss lost_;
  Clock::time_point next_survey_ = Clock::time_point::min();
  Clock::time_point next_look_ = Clock::time_point::max();
};

}  // namespace

int record(const Common& common, const RecordArguments& arguments) {
  Client client = make_client(common);
  if (const Status status = client.connect(); !status) return fail(status);
  std::signal(SIGXFSZ, SIG_IGN);  // a limit on a file's size is told as a full disk is
  Output output;
  if (const std::string problem = output.open(arguments); !problem.empty()) return fail(problem);
  if (const auto is_synchronised = is_clock_synchronised(); is_synchronised == false) {
    fail("this machine's clock is not synchronised: it says " + utc_now() +
         ", and times of this recording may not fit those of other robots; see timedatectl");
  }
  stop_on_signals(client);
  tell_what_ends_a_job();
  tell_connection(client);
  client.on_error([is_all = arguments.channels.empty()](const Status& status) {
    if (status.code() == StatusCode::kLinkDown) return;  // LinkWatch tells that
    const bool is_refusal = status.code() == StatusCode::kLimit ||
                            status.code() == StatusCode::kChannelConflict ||
                            status.code() == StatusCode::kBadChannel;
    if (!is_all || !is_refusal) fail(status.text());  // AllChannels tells those
  });
  Recording recording(client, common, arguments, output);
  const Status started = recording.start();
  if (!started) {
    output.finish(arguments.file, "nothing was recorded");
    return fail(started);
  }
  const bool is_read = recording.run();
  const int finished = output.finish(arguments.file, recording.summary());
  if (!is_read) {
    ::raise(SIGPIPE);  // as a write into the pipe would end
    return kExitFailure;
  }
  if (finished != kExitOk) return finished;
  if (caught_signal() != 0) return kExitSignal + caught_signal();
  if (arguments.count != 0 && !recording.is_enough()) {
    return fail("heard " + std::to_string(recording.heard()) + " of " +
                    std::to_string(arguments.count) + " messages within the time of -W",
                kExitTimeout);
  }
  return kExitOk;
}

}  // namespace swarmtalk::cli
