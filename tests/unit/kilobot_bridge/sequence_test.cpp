#include "kilobot_bridge/sequence.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::kilobot_bridge {
namespace {

using namespace std::chrono_literals;

const Pacing kPacing;

/// "ir type or frame, hold in ms" of all its frames.
std::vector<std::pair<int, long>> steps(Sequence sequence) {
  std::vector<std::pair<int, long>> found;
  Player player(std::move(sequence), kPacing);
  while (const auto frame = player.next()) {
    const bool is_message = is_repeated(frame->frame) || frame->frame[1] == 6;
    found.emplace_back(is_message ? frame_ir_type(frame->frame) : -frame->frame[1],
                       std::chrono::duration_cast<std::chrono::milliseconds>(frame->hold).count());
  }
  return found;
}

using Steps = std::vector<std::pair<int, long>>;
constexpr int kStop = 0;

TEST(Sequence, FollowsTheReferenceForEachCommand) {
  EXPECT_EQ(steps(command_sequence(Command::kRun)), (Steps{{0x88, 1000}, {kStop, 0}}));
  EXPECT_EQ(steps(command_sequence(Command::kReset)), (Steps{{0x83, 1000}, {kStop, 0}}));
  EXPECT_EQ(steps(command_sequence(Command::kSleep)), (Steps{{0x84, 1000}, {kStop, 0}}));
  EXPECT_EQ(steps(command_sequence(Command::kPause)), (Steps{{0x85, 1000}, {kStop, 0}}));
  EXPECT_EQ(steps(command_sequence(Command::kWakeup)), (Steps{{0x85, 12'000}, {kStop, 0}}));
  EXPECT_EQ(steps(command_sequence(Command::kCharge)), (Steps{{0x86, 1000}, {kStop, 0}}));
  EXPECT_EQ(steps(command_sequence(Command::kVoltage)), (Steps{{0x87, 500}, {kStop, 0}}));
  EXPECT_EQ(steps(led_sequence()), (Steps{{-1, 0}}));
  EXPECT_EQ(steps(stop_sequence()), (Steps{{kStop, 0}}));
  EXPECT_EQ(steps(set_uid_sequence(7)), (Steps{{0x8A, 500}, {0x8A, 500}, {kStop, 0}}));
  EXPECT_EQ(steps(calibrate_sequence(Calibration::kStraight, 60, 60, true, true)),
            (Steps{{0x8A, 500}, {0x8A, 500}, {0x85, 1000}, {kStop, 0}}));
  EXPECT_EQ(steps(message_sequence(9, {1}, false)), (Steps{{9, 0}, {kStop, 0}}));
  EXPECT_EQ(steps(message_sequence(9, {1}, true)), (Steps{{9, 0}}));
  EXPECT_EQ(steps(read_uid_sequence(std::array<std::uint8_t, 2>{0, 1}, true)),
            (Steps{{0x89, 2000}, {0x89, 2000}, {0x85, 1000}, {kStop, 0}}));
}

TEST(Sequence, ProgramsBySizeAndPagesPassAfterPass) {
  const std::vector<std::uint8_t> image(130, 1);
  EXPECT_EQ(steps(program_sequence(image, 2, false)), (Steps{{0x85, 1000},
                                                             {0x80, 2000},
                                                             {kStop, 50},
                                                             {0x82, 131},
                                                             {-4, 0},
                                                             {-4, 0},
                                                             {0x82, 131},
                                                             {-4, 0},
                                                             {-4, 0},
                                                             {kStop, 0}}));
  EXPECT_EQ(steps(program_sequence(image, 1, true)).at(0).second, 12'000);
}

TEST(Sequence, LeadsIntoTheBootloaderWithoutAProgram) {
  EXPECT_EQ(steps(bootload_sequence(false)), (Steps{{0x85, 1000}, {0x80, 2000}, {kStop, 0}}));
  EXPECT_EQ(steps(bootload_sequence(true)), (Steps{{0x85, 12'000}, {0x80, 2000}, {kStop, 0}}));
}

TEST(Sequence, SaysWhatIsHeldAnewEachSecond) {
  EXPECT_EQ(steps(held(command_sequence(Command::kRun), 2500ms)),
            (Steps{{0x88, 833}, {0x88, 833}, {0x88, 833}, {kStop, 0}}));
  EXPECT_EQ(steps(held(command_sequence(Command::kWakeup), 200ms)),
            (Steps{{0x85, 200}, {kStop, 0}}));
  EXPECT_EQ(steps(held(bootload_sequence(false), 2s)),
            (Steps{{0x85, 1000}, {0x80, 1000}, {0x80, 1000}, {kStop, 0}}));
  EXPECT_EQ(held(command_sequence(Command::kRun), kMostHold).passes, 3600u);
}

TEST(Sequence, HoldsUntilItIsStopped) {
  Player player(held(message_sequence(9, {1}, false), 0s), kPacing);
  EXPECT_EQ(player.frames(), 0u);
  for (int i = 0; i < 5000; ++i) {
    const auto frame = player.next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->hold, 1s);
  }
  player.stop();
  EXPECT_EQ(player.next()->frame, stop_frame());
  EXPECT_FALSE(player.next());
}

TEST(Sequence, TellsPositionsSixteenAtATime) {
  std::vector<GpsRecord> records(17);
  for (std::uint16_t i = 0; i < records.size(); ++i) records[i] = {i, -1, 2, -3};
  const Sequence sequence = position_sequence(records);
  ASSERT_EQ(sequence.before.size(), 2u);
  EXPECT_EQ(sequence.before[0].frame, gps_frame(std::span(records).first(16)));
  EXPECT_EQ(sequence.before[1].frame, gps_frame(std::span(records).last(1)));
  EXPECT_EQ(steps(held(sequence, 2s)),
            (Steps{{-5, 0}, {-5, 1000}, {-5, 0}, {-5, 1000}, {kStop, 0}}));
}

TEST(Sequence, SendsAChecksumOfTheCallersOwn) {
  const Sequence sequence = raw_message_sequence(9, {1}, 0xA718);
  EXPECT_EQ(sequence.before[0].frame, forward_raw_frame(9, {1}, 0xA718));
  EXPECT_EQ(steps(sequence), (Steps{{9, 0}, {kStop, 0}}));
}

TEST(Sequence, NeverMakesAOnePageProgram) {
  EXPECT_EQ(program_pages(1), 2u);
  EXPECT_EQ(program_pages(128), 2u);
  EXPECT_EQ(program_pages(256), 2u);
  EXPECT_EQ(program_pages(257), 3u);
  EXPECT_EQ(program_pages(kMostProgramBytes), 220u);
}

TEST(Player, KnowsHowFarItIsAndHowLongItTakes) {
  const std::vector<std::uint8_t> image(56 * 128, 1);
  Player player(program_sequence(image, 6, false), kPacing);
  EXPECT_EQ(player.frames(), 3 + 6 * 57 + 1u);
  // 57 frames of 165.4 ms make a pass of 9.4 s.
  EXPECT_NEAR(static_cast<double>(player.left().count()) / 1e9, 6 * 9.43 + 3.2, 0.2);
  for (int i = 0; i < 3 + 57 + 1; ++i) player.next();
  EXPECT_EQ(player.pass(), 2u);
  EXPECT_EQ(player.passes_sent(), 1u);
  EXPECT_EQ(player.index(), 0u);
  while (player.next()) {
  }
  EXPECT_EQ(player.passes_sent(), 6u);
  EXPECT_EQ(player.left().count(), 0);
}

TEST(Player, EndsWithStopWhenItIsStopped) {
  Player player(program_sequence(std::vector<std::uint8_t>(300, 1), 0, false), kPacing);
  EXPECT_EQ(player.frames(), 0u) << "it has no end of its own";
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(player.next());
  player.stop();
  EXPECT_GT(player.left(), Duration(0));
  EXPECT_LT(player.left(), std::chrono::seconds(1)) << "of what was stopped, nothing is left";
  const auto last = player.next();
  ASSERT_TRUE(last);
  EXPECT_EQ(last->frame, stop_frame());
  EXPECT_EQ(player.left(), Duration(0));
  EXPECT_FALSE(player.next());
}

}  // namespace
}  // namespace swarmtalk::kilobot_bridge
