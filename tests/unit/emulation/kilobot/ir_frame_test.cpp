#include "emulation/kilobot/ir_frame.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <string>

#include "emulation/kilobot/random.hpp"

namespace swarmtalk::emulator {
namespace {

using Data = std::array<std::uint8_t, 9>;

struct CrcVector {
  Data data;
  std::uint8_t type;
  std::uint16_t crc;
};

// Printed by the original routine.
const std::vector<CrcVector> kCrcVectors = {
    {{}, 0x00, 0x9C87},
    {{}, 0x80, 0x188F},
    {{}, 0x81, 0x0906},
    {{}, 0x82, 0x3B9D},
    {{}, 0x83, 0x2A14},
    {{}, 0x84, 0x5EAB},
    {{}, 0x85, 0x4F22},
    {{}, 0x86, 0x7DB9},
    {{}, 0x87, 0x6C30},
    {{}, 0x88, 0x94C7},
    {{}, 0x89, 0x854E},
    {{}, 0x8A, 0xB7D5},
    {{1, 2, 3, 4, 5, 6, 7, 8, 9}, 0x00, 0xA718},
    {{'h', 'e', 'l', 'l', 'o'}, 0x05, 0x7BCB},
    {{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}, 0x7F, 0x036D},
    {{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}, 0xFF, 0x8765},
    {{'1', '2', '3', '4', '5', '6', '7', '8', '9'}, '0', 0xB4EC},
};

/// Decodes pulses; nothing if no message comes out.
std::optional<IrMessage> decode(const std::vector<std::uint64_t>& pulses, double stretch = 1) {
  FrameDecoder decoder;
  std::optional<IrMessage> message;
  for (const std::uint64_t pulse_ns : pulses)
    if (decoder.on_pulse(static_cast<std::uint64_t>(static_cast<double>(pulse_ns) * stretch)) ==
        FrameDecoder::Event::kMessage)
      message = decoder.message();
  return message;
}

const IrMessage kHello = make_ir_message(Data{'h', 'e', 'l', 'l', 'o'}, 5);

TEST(IrCrc, MatchesTheVectors) {
  const std::string check = "123456789";
  EXPECT_EQ(ir_crc(std::span(reinterpret_cast<const std::uint8_t*>(check.data()), check.size())),
            0x6F91);
  for (const CrcVector& vector : kCrcVectors) {
    const IrMessage message = make_ir_message(vector.data, vector.type);
    EXPECT_EQ(message[10] + message[11] * 256, vector.crc);
    EXPECT_TRUE(has_good_crc(message));
  }
}

TEST(IrFrame, TakesAsLongAsOnTheAir) {
  const std::vector<std::uint64_t> pulses = ir_pulses(kHello);
  EXPECT_NEAR(static_cast<double>(pulses.back()) * 1e-6, 4.371, 0.04);
}

TEST(FrameDecoder, ReadsWhatWasSent) {
  Random random(1, 0);
  for (int round = 0; round < 1000; ++round) {
    Data data;
    for (std::uint8_t& byte : data) byte = static_cast<std::uint8_t>(random.next());
    const IrMessage message = make_ir_message(data, static_cast<std::uint8_t>(random.next()));
    ASSERT_EQ(decode(ir_pulses(message)), message);
  }
}

TEST(FrameDecoder, ToleratesClocksThatDifferByFivePercent) {
  for (const double stretch : {0.95, 0.96, 0.98, 1.02, 1.04, 1.05})
    EXPECT_EQ(decode(ir_pulses(kHello), stretch), kHello) << stretch;
  for (const double stretch : {0.94, 1.06})
    EXPECT_NE(decode(ir_pulses(kHello), stretch), kHello) << stretch;
}

TEST(FrameDecoder, GivesUpOnAPulseInTheLeadingByte) {
  FrameDecoder decoder;
  EXPECT_EQ(decoder.on_pulse(0), FrameDecoder::Event::kFrameStart);
  EXPECT_EQ(decoder.on_pulse(4 * kIrBitNs), FrameDecoder::Event::kBroken);
}

TEST(FrameDecoder, GivesUpOnAPulseHalfABitAfterTheStart) {
  FrameDecoder decoder;
  decoder.on_pulse(0);
  EXPECT_EQ(decoder.on_pulse(kIrBitNs / 2), FrameDecoder::Event::kBroken);
}

TEST(FrameDecoder, BeginsAnewAfterElevenSilentBits) {
  FrameDecoder decoder;
  decoder.on_pulse(0);
  EXPECT_EQ(decoder.on_pulse(12 * kIrBitNs), FrameDecoder::Event::kFrameStart);
}

TEST(FrameDecoder, SeparatesMessagesThatFollowEachOtherClosely) {
  FrameDecoder decoder;
  int starts = 0, messages = 0;
  for (std::uint64_t i = 0; i < 22; ++i)
    for (const std::uint64_t pulse_ns : ir_pulses(kHello)) {
      const auto event = decoder.on_pulse(i * 4'443'000 + pulse_ns);
      starts += event == FrameDecoder::Event::kFrameStart ? 1 : 0;
      messages += event == FrameDecoder::Event::kMessage ? 1 : 0;
    }
  EXPECT_EQ(starts, 22);
  EXPECT_EQ(messages, 22);
}

TEST(FrameDecoder, ReadsNothingGoodFromTwoMessagesOverEachOther) {
  std::vector<std::uint64_t> pulses = ir_pulses(kHello);
  for (const std::uint64_t pulse_ns : ir_pulses(make_ir_message(Data{9, 9}, 1)))
    pulses.push_back(pulse_ns + 500'000);
  std::sort(pulses.begin(), pulses.end());
  const auto message = decode(pulses);
  EXPECT_TRUE(!message || !has_good_crc(*message));
}

}  // namespace
}  // namespace swarmtalk::emulator
