#include "kilobot_bridge/frame_builder.hpp"

#include <gtest/gtest.h>

#include "kilobot_bridge/sequence.hpp"
#include "tests/unit/emulation/ohc_double/vectors.hpp"

namespace swarmtalk::kilobot_bridge {
namespace {

namespace vectors = ohc_double::vectors;

/// What the builder makes of the command that a vector is of.
OverheadFrame built(const std::string& name) {
  const auto first = [](const Sequence& sequence) { return sequence.before.at(0).frame; };
  const auto bit = [&](std::uint8_t number) {
    return first(read_uid_sequence(std::array{number}, false));
  };
  const auto calibrated = [&](Calibration mode, std::uint8_t left, std::uint8_t right) {
    return first(calibrate_sequence(mode, left, right, false, false));
  };
  const IrData digits{1, 2, 3, 4, 5, 6, 7, 8, 9};
  const std::array<GpsRecord, 2> records{{{1, 16, 32, 5}, {2, 48, 64, -1}}};
  const std::map<std::string, OverheadFrame> frames{
      {"stop", stop_frame()},
      {"led toggle", first(led_sequence())},
      {"boot", program_sequence(std::array<std::uint8_t, 1>{}, 1, false).before.at(1).frame},
      {"reset", first(command_sequence(Command::kReset))},
      {"sleep", first(command_sequence(Command::kSleep))},
      {"wake up", first(command_sequence(Command::kWakeup))},
      {"charge", first(command_sequence(Command::kCharge))},
      {"voltage", first(command_sequence(Command::kVoltage))},
      {"run", first(command_sequence(Command::kRun))},
      {"read uid 0", bit(0)},
      {"read uid 5", bit(5)},
      {"read uid 15", bit(15)},
      {"uid 1234", first(set_uid_sequence(1234))},
      {"uid 65535", first(set_uid_sequence(65535))},
      {"turn left 70", calibrated(Calibration::kTurnLeft, 70, 0)},
      {"turn right 68", calibrated(Calibration::kTurnRight, 0, 68)},
      {"straight 62 65", calibrated(Calibration::kStraight, 62, 65)},
      {"save", set_uid_sequence(1).before.at(1).frame},
      {"size 2", program_sequence(std::array<std::uint8_t, 1>{}, 1, false).repeated.at(0).frame},
      {"user 1 to 9", first(message_sequence(0, digits, false))},
      {"user hello", first(message_sequence(5, {'h', 'e', 'l', 'l', 'o'}, false))},
      {"user ones",
       first(message_sequence(127, {255, 255, 255, 255, 255, 255, 255, 255, 255}, false))},
      {"single", first(message_sequence(0, digits, true))},
      {"raw", forward_raw_frame(0, digits, 0xA718)},
      {"positions", gps_frame(records)},
  };
  return frames.at(name);
}

TEST(FrameBuilder, MakesEveryVectorOfTheStandardHostProgram) {
  for (const vectors::Vector& vector : vectors::kVectors) {
    OverheadFrame expected = vectors::frame_of(vector);
    if (vector.name == std::string("positions")) {  // its unused bytes are zero here
      expected[17] = 0;
      expected.back() = static_cast<std::uint8_t>(expected.back() ^ 7);
    }
    EXPECT_EQ(built(vector.name), expected) << vector.name;
    EXPECT_EQ(frame_problem(expected), "") << vector.name;
  }
}

TEST(FrameBuilder, CutsAProgramIntoThePagesOfTheStandardHostProgram) {
  std::vector<std::uint8_t> image;
  for (unsigned i = 0; i < 160; ++i) image.push_back(static_cast<std::uint8_t>(7 * i + 3));
  const Sequence program = program_sequence(image, 1, false);
  ASSERT_EQ(program.repeated.size(), 3u);
  const OverheadFrame page = program.repeated[1].frame;
  const auto payload = vectors::page_payload(0, 160);
  EXPECT_TRUE(std::equal(payload.begin(), payload.end(), page.begin() + 2));
  EXPECT_EQ(page.back(), 0x51);
  // Beyond the program we fill with erased flash, the standard program with zeros.
  OverheadFrame second = program.repeated[2].frame;
  EXPECT_EQ(second[3 + 32], 0xFF);
  std::fill(second.begin() + 3 + 32, second.end() - 1, std::uint8_t{0});
  EXPECT_EQ(frame_checksum(second), 0x50);
}

TEST(FrameBuilder, WritesWhenARepetitionEndsTwiceSoThatNothingElseLooksLikeIt) {
  using std::chrono::milliseconds;
  const auto copies = [](const OverheadFrame& frame) {
    EXPECT_EQ(frame_problem(frame), "");
    for (const std::size_t i : {0u, 1u})
      EXPECT_EQ(frame[kOverheadCopies + i] ^ frame[kOverheadCopies + 2 + i], 0xFF);
    return frame[kOverheadCopies] + 256 * frame[kOverheadCopies + 1];
  };
  EXPECT_EQ(copies(ending_after(forward_frame(0x88), milliseconds(1000))), 97);
  EXPECT_EQ(copies(ending_after(forward_raw_frame(3, {}, 0), milliseconds(0))), 1);
  EXPECT_EQ(copies(ending_after(forward_frame(3), milliseconds(10'000'000))), kMostCopies);
}

TEST(FrameBuilder, KnowsWhatMustNeverLeave) {
  for (unsigned page = 0; page < 256; ++page) {
    const auto frame = page_frame(static_cast<std::uint8_t>(page), {});
    EXPECT_EQ(frame_problem(frame).empty(), page < 220) << page;
  }
  for (unsigned type = 0; type < 256; ++type) {
    const bool is_good = type != 0x81 && type <= 0x8A;
    const auto ir_type = static_cast<std::uint8_t>(type);
    EXPECT_EQ(frame_problem(forward_frame(ir_type)).empty(), is_good) << type;
    EXPECT_EQ(frame_problem(forward_single_frame(ir_type)).empty(), is_good) << type;
    EXPECT_EQ(frame_problem(forward_raw_frame(ir_type, {}, 0)).empty(), is_good) << type;
  }
  OverheadFrame damaged = stop_frame();
  damaged[60] ^= 1;
  EXPECT_NE(frame_problem(damaged), "");
}

}  // namespace
}  // namespace swarmtalk::kilobot_bridge
