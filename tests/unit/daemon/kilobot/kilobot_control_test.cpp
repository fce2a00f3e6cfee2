// Commands of clients over the local protocol to a controller behind a pseudo terminal.
#include "daemon/kilobot/kilobot_control.hpp"

#include <unistd.h>

#include <algorithm>
#include <deque>
#include <map>

#include "emulation/kilobot/pty.hpp"
#include "emulation/ohc_double/frame_finder.hpp"
#include "tests/support/patience.hpp"
#include "tests/unit/daemon/session/session_harness.hpp"

namespace swarmtalk::daemon {
namespace {

using namespace std::chrono_literals;
using kilobot_bridge::KilobotLink;
using kilobot_bridge::KilobotLinkConfig;

class SilentUser final : public drivers::LinkUser {
 public:
  std::size_t pull_packet(std::span<std::uint8_t>) override { return 0; }
  std::size_t next_packet_bytes() override { return 0; }
  void on_packet(std::span<const std::uint8_t>, const drivers::FrameReception&) override {}
  frame::FrameHeader frame_header() override { return {}; }
};

class KilobotControlTest : public SessionTest {
 protected:
  KilobotControlTest() {
    KilobotLinkConfig config;
    config.downlink = pty_.device();
    config.pacing.time_scale = 100;
    config.settle = 1ms;
    link_.emplace(io_, config);
    link_->start(user_);
    control_.add("table", *link_);
    clients_.kilobots = &control_;
    run_until([&] { return link_->is_up(); });
  }
  ~KilobotControlTest() override { clients_.close_all("test ends"); }

  template <class Condition>
  void run_until(Condition condition) {
    const auto deadline = std::chrono::steady_clock::now() + test::kPatience;
    while (!condition()) {
      ASSERT_LT(std::chrono::steady_clock::now(), deadline) << "timed out";
      io_.restart();
      io_.run_for(1ms);
      std::vector<std::uint8_t> bytes;
      while (pty_.read_into(bytes) > 0) {
      }
      for (const std::uint8_t byte : bytes) {
        const auto found = finder_.put(byte);
        if (!found || found->is_false) continue;
        if (found->frame != kilobot_bridge::version_question_frame())
          frames_.push_back(found->frame);
      }
    }
  }
  /// Sends a command and returns its first answer.
  ipc::Envelope ask(TestPeer& peer, const ipc::KilobotCommand& command) {
    ipc::Envelope request;
    request.set_request_id(7);
    *request.mutable_kilobot_command() = command;
    peer.send(request);
    return wait_answer(peer, 7);
  }
  ipc::Envelope wait_answer(TestPeer& peer, std::uint32_t request_id) {
    ipc::Envelope answer;
    std::deque<ipc::Envelope>& received = received_[&peer];
    run_until([&] {
      take(peer);
      const auto found = std::find_if(received.begin(), received.end(), [&](const auto& each) {
        return each.request_id() == request_id;
      });
      if (found == received.end()) return false;
      answer = *found;
      received.erase(found);
      return true;
    });
    return answer;
  }
  void take(TestPeer& peer) {
    for (ipc::Envelope& envelope : peer.receive()) received_[&peer].push_back(envelope);
  }
  ipc::KilobotEnded wait_ended(TestPeer& peer) {
    ipc::KilobotEnded ended;
    std::deque<ipc::Envelope>& received = received_[&peer];
    run_until([&] {
      take(peer);
      for (; !received.empty(); received.pop_front()) {
        if (received.front().has_kilobot_progress()) ++progress_;
        if (!received.front().has_kilobot_ended()) continue;
        ended = received.front().kilobot_ended();
        received.pop_front();
        return true;
      }
      return false;
    });
    return ended;
  }
  std::string refusal(TestPeer& peer, const ipc::KilobotCommand& command) {
    const kilobot_bridge::Player* const in_hand = link_->player();
    const ipc::Envelope answer = ask(peer, command);
    EXPECT_TRUE(answer.has_failure());
    EXPECT_EQ(link_->player(), in_hand) << "something is sent";
    return answer.failure().text();
  }
  static ipc::KilobotCommand command(ipc::KilobotAction action) {
    ipc::KilobotCommand made;
    made.set_action(action);
    return made;
  }
  static ipc::KilobotCommand program(std::size_t bytes, std::uint32_t passes) {
    ipc::KilobotCommand made = command(ipc::KILOBOT_PROGRAM);
    made.set_image(std::string(bytes, 'U'));
    made.set_passes(passes);
    return made;
  }
  void expect_stop() {
    run_until([&] { return !frames_.empty() && frames_.back() == kilobot_bridge::stop_frame(); });
  }

  emulator::Pty pty_{""};
  SilentUser user_;
  std::optional<KilobotLink> link_;
  KilobotControl control_;
  ohc_double::FrameFinder finder_;
  std::vector<ohc_double::Frame> frames_;
  std::map<TestPeer*, std::deque<ipc::Envelope>> received_;
  unsigned progress_ = 0;
};

TEST_F(KilobotControlTest, SendsACommandAndSaysWhenItWasSent) {
  auto peer = greeted();
  const ipc::Envelope answer = ask(*peer, command(ipc::KILOBOT_RUN));
  ASSERT_TRUE(answer.has_kilobot_started());
  EXPECT_EQ(answer.request_id(), 7u);
  EXPECT_EQ(answer.kilobot_started().link(), "table");
  EXPECT_EQ(answer.kilobot_started().frames(), 2u);
  EXPECT_EQ(wait_ended(*peer).end(), ipc::KILOBOT_SENT);
  // A STOP when the device is opened, the command, and two to end its repetition: one may be lost.
  run_until([&] { return frames_.size() >= 4; });
  const auto stop = kilobot_bridge::stop_frame();
  const auto run = kilobot_bridge::ending_after(kilobot_bridge::forward_frame(0x88),
                                                std::chrono::seconds(1 + 2));  // hold and grace
  EXPECT_EQ(frames_, (std::vector{stop, run, stop, stop}));
}

TEST_F(KilobotControlTest, RefusesWhatWouldDoHarmAndSendsNothing) {
  auto peer = greeted();
  auto calibrate = command(ipc::KILOBOT_CALIBRATE);
  calibrate.set_motion(ipc::KILOBOT_LEFT);
  calibrate.set_left(121);
  EXPECT_NE(refusal(*peer, calibrate).find("--force"), std::string::npos);
  calibrate.set_left(256);
  calibrate.set_force(true);
  EXPECT_NE(refusal(*peer, calibrate).find("0 to 255"), std::string::npos);
  auto uid = command(ipc::KILOBOT_SET_UID);
  EXPECT_NE(refusal(*peer, uid), "");
  uid.set_uid(65536);
  EXPECT_NE(refusal(*peer, uid).find("0 to 65535"), std::string::npos);
  auto bit = command(ipc::KILOBOT_READ_UID);
  bit.set_bit(16);
  EXPECT_NE(refusal(*peer, bit), "");
  auto message = command(ipc::KILOBOT_SEND);
  for (const std::uint32_t type : {128u, 129u, 139u, 255u, 256u}) {
    message.set_message_type(type);
    EXPECT_NE(refusal(*peer, message).find("0 to 127"), std::string::npos);
  }
  message.set_message_type(9);
  message.set_data(std::string(10, 'x'));
  EXPECT_NE(refusal(*peer, message).find("9 bytes"), std::string::npos);
  EXPECT_NE(refusal(*peer, program(28161, 1)).find("bootloader"), std::string::npos);
  EXPECT_NE(refusal(*peer, program(0, 1)), "");
  EXPECT_NE(refusal(*peer, command(ipc::KILOBOT_UNSPECIFIED)), "");
  auto elsewhere = command(ipc::KILOBOT_RUN);
  elsewhere.set_link("wifi");
  EXPECT_NE(refusal(*peer, elsewhere).find("only table"), std::string::npos);
}

TEST_F(KilobotControlTest, RefusesHoldsChecksumsAndPositionsThatDoNotFit) {
  auto peer = greeted();
  auto held = command(ipc::KILOBOT_SET_UID);
  held.set_uid(1);
  held.set_hold_ms(1000);
  EXPECT_NE(refusal(*peer, held).find("a time of its own"), std::string::npos);
  held = command(ipc::KILOBOT_RUN);
  held.set_hold_ms(3'600'001);
  EXPECT_NE(refusal(*peer, held).find("an hour"), std::string::npos);
  auto message = command(ipc::KILOBOT_SEND);
  message.set_message_type(9);
  message.set_checksum(65536);
  EXPECT_NE(refusal(*peer, message).find("16 bits"), std::string::npos);
  auto positions = command(ipc::KILOBOT_POSITION);
  EXPECT_NE(refusal(*peer, positions).find("1 to 256"), std::string::npos);
  ipc::KilobotPosition& robot = *positions.add_positions();
  EXPECT_NE(refusal(*peer, positions).find("ends the list"), std::string::npos);
  robot.set_id(65536);
  EXPECT_NE(refusal(*peer, positions).find("id is 0 to 65535"), std::string::npos);
  robot.set_id(7);
  robot.set_y(-32769);
  EXPECT_NE(refusal(*peer, positions).find("robot 7: x and y"), std::string::npos);
  robot.set_y(0);
  robot.set_theta(128);
  EXPECT_NE(refusal(*peer, positions).find("theta is -128 to 127"), std::string::npos);
  for (int i = 0; i < 256; ++i) positions.add_positions()->set_id(1);
  EXPECT_NE(refusal(*peer, positions).find("not 257"), std::string::npos);
}

TEST_F(KilobotControlTest, HoldsAMessageUntilItsClientStopsIt) {
  auto peer = greeted();
  auto run = command(ipc::KILOBOT_RUN);
  run.set_hold_ms(0);
  const ipc::Envelope answer = ask(*peer, run);
  EXPECT_EQ(answer.kilobot_started().frames(), 0u);
  run_until([&] {
    return !frames_.empty() && std::count(frames_.begin(), frames_.end(), frames_.back()) >= 3;
  });
  EXPECT_EQ(frames_.back()[1], 2);
  ipc::Envelope cancel;
  cancel.set_request_id(8);
  cancel.mutable_kilobot_cancel()->set_operation_id(answer.kilobot_started().operation_id());
  peer->send(cancel);
  EXPECT_EQ(wait_ended(*peer).end(), ipc::KILOBOT_STOPPED);
  expect_stop();
}

TEST_F(KilobotControlTest, WarnsOfAProgramThatMayBeTheLast) {
  auto peer = greeted();
  const ipc::Envelope answer = ask(*peer, program(193 * 128, 1));
  ASSERT_EQ(answer.kilobot_started().warnings_size(), 1);
  EXPECT_NE(answer.kilobot_started().warnings(0).find("193 pages"), std::string::npos);
}

TEST_F(KilobotControlTest, SendsOneCommandAtATimeAndTellsHowFarItIs) {
  auto first = greeted();
  auto second = greeted();
  ASSERT_TRUE(ask(*first, program(400, 3)).has_kilobot_started());
  EXPECT_NE(refusal(*second, command(ipc::KILOBOT_RUN)).find("busy with 'program'"),
            std::string::npos);
  const ipc::KilobotEnded ended = wait_ended(*first);
  EXPECT_EQ(ended.end(), ipc::KILOBOT_SENT);
  EXPECT_EQ(ended.passes_sent(), 3u);
  EXPECT_EQ(progress_, 3u + 3 * 5 + 1);
}

TEST_F(KilobotControlTest, EndsACancelledCommandWithStop) {
  auto peer = greeted();
  const auto answer = ask(*peer, program(5000, 0));
  ipc::Envelope cancel;
  cancel.set_request_id(8);
  cancel.mutable_kilobot_cancel()->set_operation_id(answer.kilobot_started().operation_id());
  peer->send(cancel);
  EXPECT_EQ(wait_ended(*peer).end(), ipc::KILOBOT_STOPPED);
  expect_stop();
}

TEST_F(KilobotControlTest, StopsTheCommandOfAClientThatIsGone) {
  auto peer = greeted();
  ASSERT_TRUE(ask(*peer, program(5000, 0)).has_kilobot_started());
  run_until([&] { return frames_.size() > 3; });
  peer->hang_up();
  run_until([&] { return link_->player() == nullptr; });
  expect_stop();
}

TEST_F(KilobotControlTest, StopOfOneClientEndsTheCommandOfAnother) {
  auto first = greeted();
  auto second = greeted();
  ASSERT_TRUE(ask(*first, command(ipc::KILOBOT_WAKEUP)).has_kilobot_started());
  ASSERT_TRUE(ask(*second, command(ipc::KILOBOT_STOP)).has_kilobot_started());
  EXPECT_EQ(wait_ended(*second).end(), ipc::KILOBOT_SENT);
  const ipc::KilobotEnded ended = wait_ended(*first);
  EXPECT_EQ(ended.end(), ipc::KILOBOT_STOPPED);
  EXPECT_NE(ended.text().find("another program"), std::string::npos);
  expect_stop();
  for (int times = 0; times < 2; ++times) {  // and each later command of its own, once
    const ipc::Envelope answer = ask(*second, command(ipc::KILOBOT_STOP));
    EXPECT_EQ(wait_ended(*second).operation_id(), answer.kilobot_started().operation_id());
  }
}

TEST_F(KilobotControlTest, CancelsNobodyElsesCommand) {
  auto first = greeted();
  auto second = greeted();
  const auto answer = ask(*first, command(ipc::KILOBOT_WAKEUP));
  ipc::Envelope cancel;
  cancel.set_request_id(8);
  cancel.mutable_kilobot_cancel()->set_operation_id(answer.kilobot_started().operation_id());
  second->send(cancel);
  EXPECT_EQ(wait_answer(*second, 8).failure().code(), ipc::ERROR_UNKNOWN_ID);
  EXPECT_NE(link_->player(), nullptr);
}

TEST_F(SessionTest, WithoutAKilobotLinkCommandsAreRefused) {
  auto peer = greeted();
  ipc::Envelope request;
  request.set_request_id(1);
  request.mutable_kilobot_command()->set_action(ipc::KILOBOT_RUN);
  peer->send(request);
  step();
  const auto replies = peer->receive();
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_NE(replies[0].failure().text().find("no link of type kilobot"), std::string::npos);
}

}  // namespace
}  // namespace swarmtalk::daemon
