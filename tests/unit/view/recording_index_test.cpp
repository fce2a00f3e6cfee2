// What one reading of a recording finds.
#include "view/recording_index.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <numeric>
#include <string>

#include "recording/topic_writer.hpp"

namespace swarmtalk::view {
namespace {

constexpr std::uint64_t kFirstNs = 1'700'000'000'000'000'000;
constexpr std::uint64_t kSecondNs = 1'000'000'000;
constexpr std::uint64_t kNoLimit = UINT64_MAX;

class IndexOfAFile : public ::testing::Test {
 protected:
  IndexOfAFile() {
    std::string name = "/tmp/swarmtalk-index-XXXXXX";
    folder_ = ::mkdtemp(name.data());
    EXPECT_EQ(topics_.writer().open(folder_ + "/run.mcap", "test", true), "");
  }
  ~IndexOfAFile() override { std::filesystem::remove_all(folder_); }

  void hear(const std::string& channel, std::uint32_t number, std::uint64_t at_ns) {
    recording::HeardMessage heard;
    heard.set_channel(channel);
    heard.set_channel_number(number);
    topics_.write("/channel/" + channel, heard, at_ns);
  }
  /// One message in each second, a chunk of ten.
  void hear_for(std::uint64_t count) {
    for (std::uint64_t second = 0; second < count; ++second) {
      hear("alarm", 700, kFirstNs + second * kSecondNs);
      if (second % 10 == 9) {
        EXPECT_TRUE(topics_.writer().close_chunk());
      }
    }
  }
  void scan() {
    ASSERT_TRUE(topics_.writer().finish());
    ASSERT_EQ(reader_.open(folder_ + "/run.mcap"), "");
    sut_.scan(reader_);
  }
  /// The time of the first record that is read from a place on.
  std::uint64_t time_at(std::uint64_t place) {
    reader_.go_to(place);
    recording::Record record;
    return reader_.next(record) ? record.time_ns : 0;
  }

  std::string folder_;
  recording::TopicWriter topics_;
  recording::RecordingReader reader_;
  RecordingIndex sut_;
};

TEST_F(IndexOfAFile, WithoutRecordsIsEmpty) {
  scan();
  EXPECT_EQ(sut_.records(), 0u);
  EXPECT_EQ(sut_.number_of("alarm"), std::nullopt);
}

TEST_F(IndexOfAFile, KnowsTheTimesInWhateverOrderTheyStand) {
  hear("alarm", 700, kFirstNs + 5 * kSecondNs);
  hear("alarm", 700, kFirstNs);
  hear("alarm", 700, kFirstNs + 3 * kSecondNs);
  hear("alarm", 700, UINT64_MAX);
  scan();
  EXPECT_EQ(sut_.records(), 3u);
  EXPECT_EQ(sut_.bad_times(), 1u);
  EXPECT_EQ(sut_.first_ns(), kFirstNs);
  EXPECT_EQ(sut_.last_ns(), kFirstNs + 5 * kSecondNs);
}

TEST_F(IndexOfAFile, KnowsChannelsByNameAndByNumber) {
  hear("alarm", 700, kFirstNs);
  hear("debug", 9, kFirstNs);
  scan();
  EXPECT_EQ(sut_.number_of("alarm"), 700);
  EXPECT_EQ(sut_.number_of("700"), 700);
  EXPECT_EQ(sut_.number_of("debug"), std::nullopt) << "its messages are lines of the log";
}

TEST_F(IndexOfAFile, CountsMessagesInEqualParts) {
  hear_for(100);
  for (int i = 0; i < 50; ++i) hear("alarm", 700, kFirstNs + 99 * kSecondNs);
  scan();
  ASSERT_EQ(sut_.bars().size(), RecordingIndex::kBars);
  EXPECT_EQ(std::accumulate(sut_.bars().begin(), sut_.bars().end(), 0u), 150u);
  EXPECT_EQ(sut_.bars().back(), 51u);
}

TEST_F(IndexOfAFile, TellsFromWhereToReadForATime) {
  hear_for(100);
  scan();
  const std::uint64_t time_ns = kFirstNs + 75 * kSecondNs;
  EXPECT_EQ(time_at(sut_.start_before(kFirstNs, kSecondNs, kNoLimit).place), kFirstNs);
  const auto start = sut_.start_before(time_ns, 20 * kSecondNs, kNoLimit);
  const std::uint64_t from_ns = time_at(start.place);
  EXPECT_LE(start.known_since_ns, from_ns);
  EXPECT_LE(from_ns, time_ns - 20 * kSecondNs);
  EXPECT_GE(from_ns, time_ns - 40 * kSecondNs) << "not the whole file";
  const std::uint64_t late_ns = time_at(sut_.start_before(time_ns, 60 * kSecondNs, 15).place);
  EXPECT_GT(late_ns, time_ns - 30 * kSecondNs) << "rather less of the time before";
  EXPECT_LE(late_ns, time_ns);
}

}  // namespace
}  // namespace swarmtalk::view
