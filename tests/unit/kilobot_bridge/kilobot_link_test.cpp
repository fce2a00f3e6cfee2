// The link over pseudo terminals, in real time; the controller's pauses pass fifty times as fast.
#include "kilobot_bridge/kilobot_link.hpp"

#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <deque>
#include <random>
#include <sstream>

#include "emulation/kilobot/pty.hpp"
#include "emulation/ohc_double/frame_finder.hpp"
#include "kilobot_wire/gateway_frame.hpp"
#include "tests/support/patience.hpp"

namespace swarmtalk::kilobot_bridge {
namespace {

using namespace std::chrono_literals;
using emulator::Pty;
using Packet = std::vector<std::uint8_t>;

class KilobotLinkTest : public testing::Test, public drivers::LinkUser, public SequenceUser {
 protected:
  static std::string path(const std::string& name) {
    return testing::TempDir() + "swarmtalk-" + name + "-" + std::to_string(::getpid());
  }
  KilobotLinkConfig config(const std::string& downlink, const std::string& uplink) {
    KilobotLinkConfig made;
    made.downlink = downlink;
    made.uplink = uplink;
    made.pacing.time_scale = 50;
    made.settle = 20ms;
    made.pauses = {20ms};
    return made;
  }
  void make(const KilobotLinkConfig& link_config) {
    link_.emplace(io_, link_config);
    link_->start(*this);
  }

  // LinkUser
  std::size_t pull_packet(std::span<std::uint8_t> out) override {
    if (outgoing_.empty()) return 0;
    const Packet packet = outgoing_.front();
    if (!is_endless_) outgoing_.pop_front();
    ++pulled_;
    std::copy(packet.begin(), packet.end(), out.begin());
    return packet.size();
  }
  std::size_t next_packet_bytes() override {
    return outgoing_.empty() ? 0 : outgoing_.front().size();
  }
  void on_packet(std::span<const std::uint8_t> packet,
                 const drivers::FrameReception& frame) override {
    heard_.emplace_back(packet.begin(), packet.end());
    distances_m_.push_back(frame.distance_m);
  }
  frame::FrameHeader frame_header() override { return {}; }

  // SequenceUser
  void on_sequence_frame(const Player&) override { ++sequence_frames_; }
  void on_sequence_end(const Player&, SequenceEnd end, const std::string& text) override {
    end_ = end;
    end_text_ = text;
  }

  template <class Condition>
  bool run_until(Condition condition) {
    const auto deadline = std::chrono::steady_clock::now() + test::kPatience;
    while (!condition() && std::chrono::steady_clock::now() < deadline) {
      io_.run_for(2ms);
      io_.restart();
      if (ohc_) read_frames();
    }
    return condition();
  }
  void read_frames() {
    std::vector<std::uint8_t> bytes;
    while (ohc_->read_into(bytes) > 0) {
    }
    for (const std::uint8_t byte : bytes) {
      const auto found = finder_.put(byte);
      if (!found || found->is_false) continue;
      if (found->frame == version_question_frame()) {
        ++version_questions_;
      } else {
        frames_.push_back(as_built(found->frame));
      }
    }
  }
  /// As frame_builder makes it: without what the sender adds for the case that its host dies.
  ohc_double::Frame as_built(ohc_double::Frame frame) {
    if (!is_repeated(frame)) return frame;
    last_copies_ = frame[kOverheadCopies] + 256u * frame[kOverheadCopies + 1];
    std::fill_n(frame.begin() + kOverheadCopies, 4, std::uint8_t{0});
    frame.back() = frame_checksum(frame);
    return frame;
  }
  bool last_is(const OverheadFrame& frame) const {
    return !frames_.empty() && frames_.back() == frame;
  }
  static Packet report(std::uint8_t sequence, std::uint8_t ir_type, const Packet& data,
                       std::uint8_t mm) {
    GatewayFrame frame;
    frame.begin(GatewayKind::kReception, sequence);
    frame.append16(100);
    for (std::size_t i = 0; i < 9; ++i) frame.append(i < data.size() ? data[i] : 0);
    frame.append(ir_type);
    frame.append16(600);
    frame.append16(800);
    frame.append(mm);
    frame.end();
    Packet bytes;
    for (std::uint8_t i = 0; i < frame.size(); ++i) bytes.push_back(frame.byte(i));
    return bytes;
  }
  std::uint64_t counter(const std::string& name) const {
    for (const auto& [key, value] : link_->counters()) {
      if (key == name) return value;
    }
    ADD_FAILURE() << "no counter " << name;
    return 0;
  }
  static std::string failure(boost::asio::io_context& io, const KilobotLinkConfig& link_config) {
    try {
      KilobotLink link(io, link_config);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }

  boost::asio::io_context io_;
  std::optional<Pty> ohc_{std::in_place, path("ohc")};
  std::optional<Pty> gateway_{std::in_place, path("gateway")};
  ohc_double::FrameFinder finder_;
  std::vector<ohc_double::Frame> frames_;
  unsigned version_questions_ = 0;
  unsigned last_copies_ = 0;  // of the last repetition: how many there are to be at most
  std::deque<Packet> outgoing_;
  bool is_endless_ = false;
  unsigned pulled_ = 0;
  std::vector<Packet> heard_;
  std::vector<std::optional<float>> distances_m_;
  unsigned sequence_frames_ = 0;
  std::optional<SequenceEnd> end_;
  std::string end_text_;
  std::optional<KilobotLink> link_;
};

TEST_F(KilobotLinkTest, SaysStopFirstAndThenSendsPacketsAsMessagesOfTheOverheadController) {
  outgoing_ = {{1, 2, 3, 4, 5, 6, 7, 8, 9}};
  make(config(path("ohc"), path("gateway")));
  EXPECT_FALSE(link_->is_up());
  ASSERT_TRUE(run_until([&] { return frames_.size() >= 3; }));
  EXPECT_TRUE(link_->is_up());
  EXPECT_EQ(frames_[0], stop_frame());
  EXPECT_EQ(frames_[1], forward_frame(3, {1, 2, 3, 4, 5, 6, 7, 8, 9}));
  EXPECT_EQ(frames_[2], stop_frame());
  EXPECT_EQ(counter("packets_sent"), 1u);
}

/// A frame, whole.
Packet built(GatewayFrame& frame) {
  frame.end();
  Packet bytes;
  for (std::uint8_t i = 0; i < frame.size(); ++i) bytes.push_back(frame.byte(i));
  return bytes;
}

TEST_F(KilobotLinkTest, TellsVersionsAndTheGatewaysBattery) {
  make(config(path("ohc"), path("gateway")));
  ASSERT_TRUE(run_until([&] { return link_->is_up(); }));
  EXPECT_EQ(link_->state().find("version"), std::string::npos) << "a stock controller says nothing";
  ASSERT_TRUE(run_until([&] { return version_questions_ == 1; }));
  GatewayFrame version;
  version.begin(GatewayKind::kVersion, 0);
  version.append(kProductOverhead);
  version.append(2);
  version.append16(0xFF);
  version.append(3);
  ohc_->write(built(version));
  gateway_->write(Packet{0});
  std::uint8_t sequence = 0;
  for (const auto& [reading, colour] :
       std::initializer_list<std::pair<std::uint16_t, std::string>>{{0, "not measured yet"},
                                                                    {614, "red"},
                                                                    {615, "yellow"},
                                                                    {648, "yellow"},
                                                                    {649, "blue"},
                                                                    {682, "blue"},
                                                                    {683, "green"}}) {
    GatewayFrame hello;
    hello.begin(GatewayKind::kHello, sequence++);
    for (const unsigned word : {100, 77}) hello.append16(static_cast<std::uint16_t>(word));
    hello.append(1);
    for (const unsigned word : {0u, unsigned{reading}})
      hello.append16(static_cast<std::uint16_t>(word));
    hello.append(0);
    gateway_->write(built(hello));
    const std::string text =
        "has uid 77, version 1, battery " + std::to_string(reading) + " (" + colour + ")";
    ASSERT_TRUE(run_until([&] { return link_->state().ends_with(text); })) << link_->state();
  }
  EXPECT_TRUE(run_until([&] { return link_->state().find("(version 2)") != std::string::npos; }));
  // Another one may be plugged in.
  ohc_.reset();
  ASSERT_TRUE(run_until([&] { return !link_->is_up(); }));
  ohc_.emplace(path("ohc"));
  finder_ = {};
  ASSERT_TRUE(run_until([&] { return link_->is_up(); }));
  EXPECT_EQ(link_->state().find("(version 2)"), std::string::npos) << link_->state();
}

TEST_F(KilobotLinkTest, AsksNobodyWhoseAnswerWouldSpoilLinesOfText) {
  auto text = config(path("ohc"), path("ohc"));
  text.uplink_form = UplinkForm::kText;
  make(text);
  ASSERT_TRUE(run_until([&] { return link_->is_up(); }));
  ASSERT_EQ(link_->begin(led_sequence(), *this), "");
  ASSERT_TRUE(run_until([&] { return last_is(led_toggle_frame()); }));
  EXPECT_EQ(version_questions_, 0u);
}

TEST_F(KilobotLinkTest, TellsThatAMessageIsHeldUntilItIsStopped) {
  make(config(path("ohc"), path("gateway")));
  ASSERT_TRUE(run_until([&] { return link_->is_up(); }));
  ASSERT_EQ(link_->begin(held(command_sequence(Command::kRun), 0s), *this), "");
  ASSERT_TRUE(run_until([&] { return sequence_frames_ >= 3; }));
  EXPECT_NE(link_->state().find("sends 'run' until it is stopped"), std::string::npos);
  // 1 s and 2 s more: so soon it ends when nobody says it anew.
  EXPECT_NEAR(last_copies_ * 0.0104, 3, 0.02);
  link_->stop();
  ASSERT_TRUE(run_until([&] { return end_.has_value() && last_is(stop_frame()); }));
}

TEST_F(KilobotLinkTest, SendsPacketsOf2020UnderTheirOwnType) {
  outgoing_ = {{1, 2, 3, 4, 5, 6, 7, 8, 9}, {1, 2, 3, 4, 5, 6, 7, 8}};  // the first is too long
  auto classic = config(path("ohc"), path("gateway"));
  classic.profile = frame::ProfileId::kClassic2020;
  classic.has_single = true;
  make(classic);
  ASSERT_TRUE(run_until([&] { return frames_.size() >= 2; }));
  EXPECT_EQ(frames_[1], forward_single_frame(0, {1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(counter("packets_over_mtu"), 1u);
  gateway_->write(Packet{0});
  gateway_->write(report(0, 0, {9, 8, 7, 6, 5, 4, 3, 2}, 50));
  ASSERT_TRUE(run_until([&] { return heard_.size() == 1; }));
  EXPECT_EQ(heard_[0], (Packet{9, 8, 7, 6, 5, 4, 3, 2}));
}

TEST_F(KilobotLinkTest, HandsUpWhatTheGatewayHearsWithItsDistance) {
  make(config(path("ohc"), path("gateway")));
  gateway_->write(Packet{0});
  gateway_->write(report(0, 2, {1, 2, 3, 4, 5, 6, 7, 8, 9}, 48));
  gateway_->write(report(1, 2, {2}, 0xFF));
  gateway_->write(report(2, 3, {3}, 60));  // an overhead controller's light
  gateway_->write(report(3, 9, {4}, 60));  // a program's own message
  ASSERT_TRUE(run_until([&] { return counter("gateway_other_messages") == 1; }));
  ASSERT_EQ(heard_.size(), 3u);
  EXPECT_EQ(heard_[0], (Packet{1, 2, 3, 4, 5, 6, 7, 8, 9}));
  EXPECT_FLOAT_EQ(*distances_m_[0], 0.048f);
  EXPECT_FALSE(distances_m_[1]);
  EXPECT_FALSE(distances_m_[2]);
}

TEST_F(KilobotLinkTest, KnowsItsOwnPacketsInTheLightThatTheGatewayHears) {
  const Packet own = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  outgoing_ = {own};
  make(config(path("ohc"), path("gateway")));
  ASSERT_TRUE(run_until([&] { return counter("packets_sent") == 1; }));
  gateway_->write(Packet{0});
  gateway_->write(report(0, 3, own, 60));
  gateway_->write(report(1, 3, own, 60));  // the controller repeats
  gateway_->write(report(2, 3, {0}, 60));  // another controller's
  gateway_->write(report(3, 2, own, 60));  // a robot's
  ASSERT_TRUE(run_until([&] { return heard_.size() == 2; }));
  EXPECT_EQ(heard_[0], Packet(9));
  EXPECT_EQ(heard_[1], own);
  EXPECT_EQ(counter("own_echoes"), 2u);
  EXPECT_EQ(counter("packets_received"), 2u);
}

TEST_F(KilobotLinkTest, WorksWithOneDeviceForBothWaysUnderTwoNames) {
  outgoing_ = {{1}};
  make(config(path("ohc"), ohc_->device()));
  ohc_->write(Packet{0});
  ohc_->write(report(0, 2, {7}, 40));
  ASSERT_TRUE(run_until([&] { return heard_.size() == 1 && frames_.size() >= 2; }));
  EXPECT_EQ(link_->device(), path("ohc"));
}

TEST_F(KilobotLinkTest, LosesNoneOfAHundredReportsPerSecond) {
  make(config(path("ohc"), path("gateway")));
  gateway_->write(Packet{0});
  unsigned written = 0;
  for (unsigned second = 0; second < 5; ++second) {
    for (unsigned i = 0; i < 100; ++i, ++written) {
      gateway_->write(
          report(static_cast<std::uint8_t>(written), 2, {static_cast<std::uint8_t>(written)}, 40));
    }
    ASSERT_TRUE(run_until([&] { return heard_.size() == written; })) << heard_.size();
  }
  EXPECT_EQ(counter("gateway_frames_missing"), 0u);
  gateway_->write(report(static_cast<std::uint8_t>(written + 5), 2, {0}, 40));
  ASSERT_TRUE(run_until([&] { return heard_.size() == written + 1; }));
  EXPECT_EQ(counter("gateway_frames_missing"), 5u);
}

TEST_F(KilobotLinkTest, TakesGarbageForNothing) {
  make(config(path("ohc"), path("gateway")));
  std::mt19937 random(5);
  std::uint64_t written = 0;
  for (unsigned i = 0; i < 50; ++i) {
    Packet garbage(1000);
    for (std::uint8_t& byte : garbage) byte = static_cast<std::uint8_t>(random());
    gateway_->write(garbage);
    written += garbage.size();
    ASSERT_TRUE(run_until([&] { return counter("bytes_received") == written; }));
  }
  EXPECT_TRUE(heard_.empty());
  EXPECT_GT(counter("gateway_frames_unreadable"), 100u);
  gateway_->write(Packet{0});
  gateway_->write(report(0, 2, {1}, 40));
  EXPECT_TRUE(run_until([&] { return heard_.size() == 1; }));
}

TEST_F(KilobotLinkTest, TellsOfUnreadableFramesAtMostOnceASecondAndOfEachOnce) {
  std::ostringstream logged;
  const auto sink = std::make_shared<spdlog::sinks::ostream_sink_mt>(logged);
  sink->set_pattern("%v");
  spdlog::register_logger(std::make_shared<spdlog::logger>("link", sink));
  make(config(path("ohc"), path("gateway")));
  const auto begin = std::chrono::steady_clock::now();
  const auto told = [&] {
    std::vector<std::uint64_t> numbers;
    std::istringstream lines(logged.str());
    for (std::string line; std::getline(lines, line);) {
      const std::size_t end = line.find(" unreadable frames");
      if (end == std::string::npos) continue;
      numbers.push_back(std::stoull(line.substr(line.rfind(' ', end - 1) + 1)));
    }
    return numbers;
  };
  ASSERT_TRUE(run_until([&] {
    gateway_->write(Packet{0, 1, 2, 3, 0});
    return told().size() == 3;
  }));
  spdlog::drop("link");
  EXPECT_GE(std::chrono::steady_clock::now() - begin, 2s);
  const std::vector<std::uint64_t> numbers = told();  // some may have come after the last line
  EXPECT_LE(numbers[0] + numbers[1] + numbers[2], counter("gateway_frames_unreadable"));
}

TEST_F(KilobotLinkTest, ComesBackAfterItWasUnpluggedUnderLoad) {
  outgoing_ = {{1, 2, 3}};
  is_endless_ = true;
  make(config(path("ohc"), path("gateway")));
  ASSERT_TRUE(run_until([&] { return frames_.size() > 20; }));
  ASSERT_EQ(link_->begin(command_sequence(Command::kWakeup), *this), "");
  ASSERT_TRUE(run_until([&] { return sequence_frames_ == 1; }));
  ohc_.reset();
  ASSERT_TRUE(run_until([&] { return end_.has_value(); }));
  EXPECT_EQ(*end_, SequenceEnd::kFailed);
  EXPECT_NE(end_text_.find(path("ohc")), std::string::npos);
  EXPECT_NE(end_text_.find("is lost"), std::string::npos) << end_text_;
  EXPECT_FALSE(link_->is_up());
  EXPECT_NE(link_->state().find("no overhead controller at " + path("ohc")), std::string::npos);
  EXPECT_NE(link_->begin(stop_sequence(), *this), "");
  const unsigned pulled = pulled_;
  io_.run_for(60ms);
  io_.restart();
  EXPECT_EQ(pulled_, pulled) << "packets are thrown away";
  ohc_.emplace(path("ohc"));
  frames_.clear();
  finder_ = {};
  ASSERT_TRUE(run_until([&] { return frames_.size() > 20; }));
  EXPECT_EQ(frames_[0], stop_frame());
  EXPECT_EQ(frames_[1], forward_frame(3, {1, 2, 3})) << "the wakeup was taken up again";
  EXPECT_EQ(counter("link_down_events"), 1u);
}

TEST_F(KilobotLinkTest, GivesUpADeviceThatTakesNoBytes) {
  outgoing_ = {{1}};
  is_endless_ = true;
  auto slow = config(path("gateway"), "");  // read by nobody
  make(slow);
  ASSERT_TRUE(run_until([&] { return counter("link_down_events") == 1; }));
  EXPECT_NE(link_->state().find("takes no bytes"), std::string::npos);
}

TEST_F(KilobotLinkTest, WaitsForADeviceThatIsNotThereYet) {
  ohc_.reset();
  make(config(path("ohc"), path("gateway")));
  EXPECT_NE(link_->state().find("No such file"), std::string::npos) << link_->state();
  EXPECT_FALSE(link_->is_up());
  ohc_.emplace(path("ohc"));
  EXPECT_TRUE(run_until([&] { return link_->is_up(); }));
}

TEST_F(KilobotLinkTest, RefusesADeviceThatAnotherProgramHasAndWhatIsNone) {
  make(config(path("ohc"), path("gateway")));
  EXPECT_NE(failure(io_, config(path("ohc"), "")).find("another program has it open"),
            std::string::npos);
  EXPECT_NE(failure(io_, config("/dev/null", "")).find("not a serial device"), std::string::npos);
  EXPECT_NE(failure(io_, config("", "")).find("neither"), std::string::npos);
}

TEST_F(KilobotLinkTest, OpensNothingThatItWasNotGiven) {
  make(config("", path("gateway")));
  io_.run_for(50ms);
  SerialDevice other;
  EXPECT_EQ(other.open(ohc_->device(), 38400).kind, OpenProblem::Kind::kNone);
  EXPECT_NE(link_->begin(stop_sequence(), *this).find("no downlink"), std::string::npos);
}

TEST_F(KilobotLinkTest, LetsNoPacketBetweenTheFramesOfAProgram) {
  outgoing_ = {{1, 2, 3}};
  is_endless_ = true;
  make(config(path("ohc"), path("gateway")));
  ASSERT_TRUE(run_until([&] { return frames_.size() > 3; }));
  const Packet image(3 * 128, 0x55);
  ASSERT_EQ(link_->begin(program_sequence(image, 2, false), *this), "");
  EXPECT_FALSE(link_->is_up());
  EXPECT_NE(link_->state().find("sends 'program', "), std::string::npos) << link_->state();
  EXPECT_NE(link_->state().find(" left"), std::string::npos) << link_->state();
  EXPECT_NE(link_->begin(command_sequence(Command::kRun), *this).find("busy with 'program'"),
            std::string::npos);
  ASSERT_TRUE(run_until([&] { return end_.has_value(); }));
  EXPECT_EQ(*end_, SequenceEnd::kSent);
  EXPECT_EQ(sequence_frames_, 3u + 2 * 4 + 1);
  ASSERT_TRUE(run_until([&] { return last_is(forward_frame(3, {1, 2, 3})); }));
  const auto boot = std::find(frames_.begin(), frames_.end(), forward_frame(0x80));
  const auto last_page = std::find_if(frames_.rbegin(), frames_.rend(),
                                      [](const auto& frame) { return frame[1] == 4; });
  ASSERT_NE(boot, frames_.end());
  ASSERT_NE(last_page, frames_.rend());
  EXPECT_EQ(std::find(boot, last_page.base(), forward_frame(3, {1, 2, 3})), last_page.base());
}

TEST_F(KilobotLinkTest, StopsAProgramAtOnceAndSaysStop) {
  make(config(path("ohc"), path("gateway")));
  ASSERT_TRUE(run_until([&] { return link_->is_up(); }));
  ASSERT_EQ(link_->begin(program_sequence(Packet(5000, 1), 0, true), *this), "");
  ASSERT_TRUE(run_until([&] { return sequence_frames_ >= 1; }));
  link_->stop();
  ASSERT_TRUE(run_until([&] { return end_.has_value(); }));
  EXPECT_EQ(*end_, SequenceEnd::kStopped);
  EXPECT_EQ(sequence_frames_, 2u) << "the WAKEUP and the STOP";
  ASSERT_TRUE(run_until([&] { return last_is(stop_frame()); }));
}

TEST_F(KilobotLinkTest, TellsHowLongACommandOfOneMessageIsStillHeld) {
  auto real_time = config(path("ohc"), path("gateway"));
  real_time.pacing.time_scale = 1;
  make(real_time);
  ASSERT_TRUE(run_until([&] { return link_->is_up(); }));
  ASSERT_EQ(link_->begin(command_sequence(Command::kWakeup), *this), "");
  ASSERT_TRUE(run_until([&] { return last_is(forward_frame(0x85)); }));
  const std::string refusal = link_->begin(command_sequence(Command::kRun), *this);
  EXPECT_NE(refusal.find("for another 0:1"), std::string::npos) << refusal << "; it takes 12 s";
  EXPECT_NE(link_->state().find("0:1"), std::string::npos) << link_->state();
}

/// A host that is killed cannot send STOP: our controller then ends 2 s after the hold of 12 s.
TEST_F(KilobotLinkTest, TellsTheControllerWhenARepetitionIsToEndByItself) {
  make(config(path("ohc"), path("gateway")));
  ASSERT_TRUE(run_until([&] { return link_->is_up(); }));
  ASSERT_EQ(link_->begin(command_sequence(Command::kWakeup), *this), "");
  ASSERT_TRUE(run_until([&] { return last_is(forward_frame(0x85)); }));
  EXPECT_NEAR(last_copies_ * 0.0104, 14, 0.02);
}

TEST_F(KilobotLinkTest, LeavesAStopBehindWhenItGoes) {
  make(config(path("ohc"), path("gateway")));
  ASSERT_TRUE(run_until([&] { return link_->is_up(); }));
  ASSERT_EQ(link_->begin(command_sequence(Command::kWakeup), *this), "");
  ASSERT_TRUE(run_until([&] { return last_is(forward_frame(0x85)); }));
  link_.reset();
  read_frames();
  EXPECT_EQ(frames_.back(), stop_frame());
}

TEST_F(KilobotLinkTest, HandsUpLinesOfATextUplink) {
  auto text = config("", path("gateway"));
  text.uplink_form = UplinkForm::kText;
  make(text);
  std::vector<std::string> lines;
  link_->set_text_hook([&](const std::string& line) { lines.push_back(line); });
  const std::string said = "hello\r\nworld\n";
  gateway_->write({reinterpret_cast<const std::uint8_t*>(said.data()), said.size()});
  ASSERT_TRUE(run_until([&] { return lines.size() == 2; }));
  EXPECT_EQ(lines, (std::vector<std::string>{"hello", "world"}));
}

}  // namespace
}  // namespace swarmtalk::kilobot_bridge
