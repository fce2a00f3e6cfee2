#include "emulation/ohc_double/frame_finder.hpp"

#include <gtest/gtest.h>

#include "tests/unit/emulation/ohc_double/vectors.hpp"

namespace swarmtalk::ohc_double {
namespace {

struct Found {
  std::size_t after_bytes;
  unsigned type;
  bool is_false;
  bool operator==(const Found&) const = default;
};

std::ostream& operator<<(std::ostream& out, const Found& found) {
  return out << found.type << " after " << found.after_bytes << (found.is_false ? " (false)" : "");
}

class FrameFinderTest : public testing::Test {
 protected:
  template <class Bytes>
  void feed(const Bytes& bytes) {
    for (const std::uint8_t byte : bytes) {
      ++count_;
      if (const auto found = finder_.put(byte))
        found_.push_back({count_, found->frame[1], found->is_false});
    }
  }

  FrameFinder finder_;
  std::size_t count_ = 0;
  std::vector<Found> found_;
};

TEST(OhcFrame, IsMadeAsTheStandardHostMakesIt) {
  for (const vectors::Vector& vector : vectors::kVectors) {
    const Frame frame = vectors::frame_of(vector);
    EXPECT_EQ(make_frame(frame[1], std::span(frame).subspan(2, 129)), frame) << vector.name;
  }
}

TEST(OhcFrame, CarriesAPage) {
  const Frame page0 = make_frame(FrameType::kBootPage, vectors::page_payload(0, 160));
  EXPECT_EQ(page0[131], 0x51);
  const Frame page1 = make_frame(FrameType::kBootPage, vectors::page_payload(1, 160));
  EXPECT_EQ(page1[131], 0x50);
}

TEST_F(FrameFinderTest, FindsEveryVectorAtItsLastByte) {
  for (const vectors::Vector& vector : vectors::kVectors) {
    FrameFinder fresh;
    const Frame frame = vectors::frame_of(vector);
    for (std::size_t i = 0; i < kFrameBytes; ++i) {
      const auto found = fresh.put(frame[i]);
      ASSERT_EQ(found.has_value(), i == kFrameBytes - 1) << vector.name << " at byte " << i;
      if (found) {
        EXPECT_EQ(found->frame, frame);
      }
    }
  }
}

TEST_F(FrameFinderTest, SeesAFalseFrameOneByteBeforeTheEndOfTwoStops) {
  const Frame stop = make_frame(FrameType::kStop);
  feed(stop);
  feed(stop);
  const std::vector<Found> expected{{132, 0, false}, {263, 0x55, true}, {264, 0, false}};
  EXPECT_EQ(found_, expected);
}

TEST_F(FrameFinderTest, SeesAFalseLedToggleInARepeatedSingleFrame) {
  const std::array<std::uint8_t, 2> data{0x55, 0x01};
  const Frame single = make_message_frame(FrameType::kSingle, 7, data);
  feed(single);
  feed(single);
  const std::vector<Found> expected{{132, 6, false}, {134, 1, true}, {264, 6, false}};
  EXPECT_EQ(found_, expected);
}

TEST_F(FrameFinderTest, RecoversFromALostByteWithTheNextFrame) {
  const Frame run = make_message_frame(FrameType::kForward, kIrRun);
  const std::array<std::uint8_t, 9> data{1, 2, 3, 4, 5, 6, 7, 8, 9};
  std::vector<std::uint8_t> cut(run.begin(), run.end());
  cut.erase(cut.begin() + 60);
  feed(cut);
  feed(make_message_frame(FrameType::kSingle, 0, data));
  const std::vector<Found> expected{{263, 6, false}};
  EXPECT_EQ(found_, expected);
}

TEST_F(FrameFinderTest, IgnoresAFrameWithAWrongChecksum) {
  Frame run = make_message_frame(FrameType::kForward, kIrRun);
  run[131] ^= 1;
  feed(run);
  EXPECT_TRUE(found_.empty());
  feed(make_frame(FrameType::kLedToggle));
  ASSERT_EQ(found_.size(), 1u);
  EXPECT_EQ(found_[0].type, 1u);
}

TEST_F(FrameFinderTest, IgnoresZerosBeforeAFrame) {
  feed(std::vector<std::uint8_t>(132));
  feed(make_message_frame(FrameType::kForward, kIrRun));
  const std::vector<Found> expected{{264, 2, false}};
  EXPECT_EQ(found_, expected);
}

}  // namespace
}  // namespace swarmtalk::ohc_double
