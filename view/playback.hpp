// Playback: the source that is a recording. It takes the file's records into Swarm and Traffic as
// the shown time passes them; all who look see the same time, and any of them may move it. A jump
// reads the records of the time before it, for as long as a robot is remembered, so what is shown
// does not depend on the way there. On the io_context's thread.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "recording/recording_reader.hpp"
#include "view/recent_messages.hpp"
#include "view/recording_index.hpp"
#include "view/source.hpp"

namespace swarmtalk::view {

class Playback final : public Source {
 public:
  using Milliseconds = std::chrono::milliseconds;

  static constexpr std::uint64_t kMostRecordsOfAJump = 200'000;  // rather less of the time before
  static constexpr double kLeastSpeed = 0.1;
  static constexpr double kMostSpeed = 100;

  static constexpr auto kTrail = std::chrono::seconds(12);  // before a jump's end
  static constexpr auto kTrailStep = std::chrono::milliseconds(500);
  static constexpr std::size_t kMostSpots = 256;  // robots of one step

  struct Spot {
    std::uint32_t robot = 0;
    float x_m = 0, y_m = 0;
  };
  /// Where robots were at a time on the way.
  struct Step {
    Milliseconds at{0};
    std::vector<Spot> spots;
  };

  explicit Playback(boost::asio::io_context& io) : timer_(io) {}

  /// Reads the whole file once. @return empty, or one sentence: nothing in it can be shown
  std::string open(const std::string& path);

  const std::string& file() const { return file_; }  // without its folder
  /// What of the file cannot be shown, one sentence; empty: nothing.
  const std::string& problem() const { return problem_; }
  Milliseconds length() const;
  /// Messages in each of equal parts of the time.
  const std::vector<std::uint32_t>& bars() const { return index_.bars(); }

  Milliseconds at() const;
  /// From when on what was heard is known: a jump reads only some of the time before it. 0: all.
  Milliseconds known_since() const;
  /// What led to the time of the last jump.
  const std::vector<Step>& trail() const { return trail_; }
  bool is_playing() const { return is_playing_; }
  double speed() const { return speed_; }

  /// At the end: from the beginning again.
  void play();
  void pause() { is_playing_ = false; }
  /// Beyond the end: the end. Takes effect within a moment; of several the last.
  void seek(Milliseconds at);
  /// @param speed  times as fast; is brought between kLeastSpeed and kMostSpeed
  void set_speed(double speed);

  /// What the timer does: goes on by so much of real time. For tests.
  void pass(std::chrono::nanoseconds real_time);

  Time now() const override;
  std::uint64_t wall_ns() const override { return at_ns_; }
  Playback* playback() override { return this; }
  /// Nobody looks: the time stands still.
  void set_watched(bool is_watched) override;
  void want_details(std::uint32_t) override {}
  Status questions() const override { return Status(); }
  Status open_channel(const std::string& name) override;
  void close_channel(const std::string&) override {}
  std::optional<std::uint16_t> number_of(const std::string& name) const override;
  const LeftOut& left_out() const override { return left_out_; }
  const std::deque<HeardMessage>& recent_messages(std::uint16_t channel) const override {
    return recent_.of(channel);
  }
  Status publish(const std::string& channel, const std::string& payload) override;
  const DaemonStatus& status() const override { return status_; }

 private:
  void keep(const HeardMessage& message) override { recent_.add(message); }
  bool next(recording::Record& record);
  void wait_turn();
  void jump_to(std::uint64_t time_ns);
  void run_to(std::uint64_t time_ns);
  void add_step();
  void take(const recording::Record& record);
  void take_heard(const recording::HeardMessage& heard, Time at);
  void take_pose(const recording::RobotPose& pose, Time at);
  void take_losses(const recording::ChannelLosses& losses);
  void take_reception(const recording::Reception& reception, Time at);

  boost::asio::steady_timer timer_;
  std::string file_;
  std::string problem_;
  recording::RecordingReader reader_;
  RecordingIndex index_;
  RecentMessages recent_;
  std::vector<Step> trail_;
  std::uint64_t at_ns_ = 0;
  std::uint64_t known_since_ns_ = 0;       // at or before the first: from the beginning
  std::optional<recording::Record> held_;  // read already, and its time has not come
  std::optional<std::uint64_t> jump_ns_;
  Clock::time_point turned_at_{};
  double speed_ = 1;
  bool is_playing_ = true;
  bool is_watched_ = false;
  bool is_waiting_ = false;
  DaemonStatus status_;
  LeftOut left_out_;  // none
};

}  // namespace swarmtalk::view
