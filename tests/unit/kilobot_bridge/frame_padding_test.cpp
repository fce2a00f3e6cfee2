#include "kilobot_bridge/frame_padding.hpp"

#include <gtest/gtest.h>

#include <random>

#include "emulation/ohc_double/frame_finder.hpp"

namespace swarmtalk::kilobot_bridge {
namespace {

using ohc_double::FrameFinder;

/// A controller's parser that counts the frames which nobody has sent.
class Controller {
 public:
  void hear(std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) {
      const auto found = finder_.put(byte);
      if (!found) continue;
      types.push_back(found->frame[1]);
      if (!found->is_false) continue;
      dangerous += found->frame[1] >= 1 && found->frame[1] <= 6 ? 1 : 0;
    }
  }

  std::vector<std::uint8_t> types;
  unsigned dangerous = 0;

 private:
  FrameFinder finder_;
};

/// Frames full of 0x55 and of what may follow it, with common beginnings: they meet often.
OverheadFrame adversarial_frame(std::mt19937& random) {
  static constexpr std::array<std::uint8_t, 8> kBytes{0x55, 0x55, 0x00, 0x01, 0x02, 0x04, 0x05, 6};
  const auto byte = [&] { return kBytes[random() % kBytes.size()]; };
  IrData data{};
  for (std::uint8_t& each : data) each = byte();
  switch (random() % 5) {
    case 0:
      return stop_frame();
    case 1:
      return forward_frame(byte(), data);
    case 2:
      return forward_single_frame(byte(), data);
    default: {
      ProgramPage page;
      const bool is_sparse = random() % 2 == 0;
      for (std::uint8_t& each : page) each = is_sparse && random() % 8 != 0 ? 0 : byte();
      return page_frame(static_cast<std::uint8_t>(random() % 2 == 0 ? 0x55 : random() % 220), page);
    }
  }
}

TEST(FramePadding, LeavesNoDangerousFrameInTwentyThousandAdversarialPairs) {
  std::mt19937 random(20131017);
  unsigned unpadded_dangers = 0, padded = 0, beyond_zeros = 0, dangers = 0;
  for (unsigned pair = 0; pair < 20'000; ++pair) {
    const OverheadFrame first = adversarial_frame(random);
    const OverheadFrame second = random() % 4 == 0 ? first : adversarial_frame(random);
    Controller careless;
    careless.hear(first);
    careless.hear(second);
    unpadded_dangers += careless.dangerous > 0 ? 1 : 0;
    FramePadding padding;
    Controller controller;
    for (const OverheadFrame& frame : {first, second}) {
      const auto bytes = padding.pad(frame);
      ASSERT_GE(bytes.size(), frame.size());
      padded += bytes.size() > frame.size() ? 1 : 0;
      beyond_zeros += bytes.size() > frame.size() && bytes.front() != 0 ? 1 : 0;
      padding.on_written(bytes);
      controller.hear(bytes);
      ASSERT_FALSE(controller.types.empty());
      ASSERT_EQ(controller.types.back(), frame[1]) << "pair " << pair;
    }
    dangers += controller.dangerous;
  }
  std::printf("%u pairs dangerous without padding; %u frames padded, %u not by zeros alone\n",
              unpadded_dangers, padded, beyond_zeros);
  EXPECT_EQ(dangers, 0u);
  EXPECT_GT(unpadded_dangers, 1000u) << "the pairs are not adversarial";
  EXPECT_GT(beyond_zeros, 10u) << "the hardest case does not occur";
}

TEST(FramePadding, KeepsALongStreamSafe) {
  std::mt19937 random(7);
  FramePadding padding;
  Controller controller;
  for (unsigned i = 0; i < 5000; ++i) {
    const auto bytes = padding.pad(adversarial_frame(random));
    ASSERT_FALSE(bytes.empty());
    padding.on_written(bytes);
    controller.hear(bytes);
  }
  EXPECT_EQ(controller.dangerous, 0u);
}

TEST(FramePadding, AvoidsTheFalseToggleOfTheReferenceVector) {
  const OverheadFrame frame = forward_single_frame(7, {0x55, 0x01});
  Controller careless;
  careless.hear(frame);
  careless.hear(frame);
  EXPECT_EQ(careless.types, (std::vector<std::uint8_t>{6, 1, 6}));
  FramePadding padding;
  padding.on_written(frame);
  Controller controller;
  controller.hear(frame);
  controller.hear(padding.pad(frame));
  EXPECT_EQ(controller.types, (std::vector<std::uint8_t>{6, 6}));
}

TEST(FramePadding, TakesAHarmlessFalseFrameForNothing) {
  FramePadding padding;
  padding.on_written(stop_frame());
  EXPECT_EQ(padding.pad(stop_frame()).size(), stop_frame().size()) << "its false type is 0x55";
}

TEST(FramePadding, IsSafeWhetherOrNotTheControllerWasResetMeanwhile) {
  std::mt19937 random(11);
  for (unsigned i = 0; i < 3000; ++i) {
    const OverheadFrame before = adversarial_frame(random);
    FramePadding padding;
    padding.on_written(before);
    padding.on_reopened();
    const auto bytes = padding.pad(adversarial_frame(random));
    ASSERT_FALSE(bytes.empty());
    Controller kept, reset;
    kept.hear(before);
    kept.hear(bytes);
    reset.hear(bytes);
    ASSERT_EQ(kept.dangerous + reset.dangerous, 0u);
  }
}

}  // namespace
}  // namespace swarmtalk::kilobot_bridge
