// What our messages look like in a recording, and that its schemas describe them to strangers.
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "recording/recorder.hpp"
#include "recording/recording_reader.hpp"
#include "recording/time_order.hpp"

namespace swarmtalk::recording {
namespace {

using std::chrono::milliseconds;

class Recording : public ::testing::Test {
 protected:
  Recording() {
    std::string name = "/tmp/swarmtalk-recording-XXXXXX";
    folder = ::mkdtemp(name.data());
    path = folder + "/a.mcap";
  }
  ~Recording() override { std::filesystem::remove_all(folder); }

  std::string folder;
  std::string path;
  const Recorder::Clock::time_point now = Recorder::Clock::now();
};

swarmtalk::Message message_of(const std::string& payload) {
  swarmtalk::Message message;
  message.payload = payload;
  message.channel = 7;
  message.sender = 3;
  message.epoch = 9;
  message.message_number = 41;
  message.distance_m = 0.5F;
  message.sender_pose = swarmtalk::Pose{1, 2, 3, milliseconds(40)};
  message.hops = 1;
  message.ttl = 2;
  message.lost_before.air = 5;
  return message;
}

TEST_F(Recording, KeepsAMessageWithAllThatWasSensed) {
  Recorder recorder;
  ASSERT_EQ(recorder.open(path, "test", false), "");
  ASSERT_TRUE(recorder.heard("alarm", message_of("fire"), now));
  ASSERT_TRUE(recorder.heard("alarm", message_of(std::string("\xff\0", 2)), now + milliseconds(5)));
  ASSERT_TRUE(recorder.finish());
  RecordingReader reader;
  ASSERT_EQ(reader.open(path), "");
  Record record;
  ASSERT_TRUE(reader.next(record));
  EXPECT_EQ(record.kind, Record::Kind::kHeard);
  EXPECT_EQ(record.topic, "/channel/alarm");
  EXPECT_EQ(record.heard.payload(), "fire");
  EXPECT_EQ(record.heard.text(), "fire");
  EXPECT_EQ(record.heard.sender(), 3u);
  EXPECT_FLOAT_EQ(record.heard.distance_m(), 0.5F);
  EXPECT_FALSE(record.heard.has_bearing_rad());
  EXPECT_EQ(record.heard.sender_pose().age_ms(), 40u);
  EXPECT_EQ(record.heard.lost_before().air(), 5u);
  const std::uint64_t first_ns = record.time_ns;
  ASSERT_TRUE(reader.next(record));
  EXPECT_FALSE(record.heard.has_text());
  EXPECT_EQ(record.heard.payload(), std::string("\xff\0", 2));
  EXPECT_EQ(record.time_ns - first_ns, 5'000'000u);
  EXPECT_FALSE(reader.next(record));
  EXPECT_EQ(reader.problem(), "");
}

// Two channels' messages of one moment are handed out channel by channel.
TEST_F(Recording, TimeOrderPutsWhatCameInOneMomentBackInOrder) {
  Recorder recorder;
  ASSERT_EQ(recorder.open(path, "test", false), "");
  const auto hear = [&](const char* channel, const char* text, int ms) {
    swarmtalk::Message message = message_of(text);
    message.channel = static_cast<std::uint16_t>(*channel);
    ASSERT_TRUE(recorder.heard(channel, message, now + milliseconds(ms)));
  };
  hear("a", "1", 10);
  hear("b", "3", 30);
  hear("a", "2", 20);
  hear("b", "3 too", 30);
  hear("c", "left out", 30);
  hear("b", "5", 2000);
  hear("a", "4", 1001);
  ASSERT_TRUE(recorder.finish());
  RecordingReader reader;
  ASSERT_EQ(reader.open(path), "");
  TimeOrder records(reader, [](const Record& each) { return each.topic != "/channel/c"; });
  std::vector<std::string> told;
  for (Record record; records.next(record);) told.push_back(record.heard.payload());
  EXPECT_EQ(told, (std::vector<std::string>{"1", "2", "3", "3 too", "4", "5"}));
}

TEST_F(Recording, WhatStandsTooFarAfterLaterOnesIsCounted) {
  constexpr std::uint64_t kSecondNs = 1'000'000'000;
  TimeOrder::Misplaced misplaced{TimeOrder::kWindow};
  for (const std::uint64_t tenths : {10, 30, 20, 31, 100, 90, 110}) {
    misplaced.note(tenths * kSecondNs / 10);
  }
  EXPECT_EQ(misplaced.text("message"), "");
  misplaced.note(9 * kSecondNs);
  EXPECT_EQ(misplaced.text("message").find("1 message is not in the order of time"), 0u);
  misplaced.note(9 * kSecondNs);
  misplaced.note(11 * kSecondNs);
  EXPECT_EQ(misplaced.text("record").find("2 records are not"), 0u);
  EXPECT_NE(misplaced.text("record").find("mcap sort"), std::string::npos);
}

// A channel has its number's digits for a name until a program of this robot names it.
TEST_F(Recording, AChannelIsOneTopicWhateverItsNameWasAtTheMoment) {
  Recorder recorder;
  ASSERT_EQ(recorder.open(path, "test", false), "");
  ASSERT_TRUE(recorder.heard("7", message_of("1"), now));
  ASSERT_TRUE(recorder.heard("p", message_of("2"), now));
  swarmtalk::Message other = message_of("3");
  other.channel = 8;
  ASSERT_TRUE(recorder.heard("p", other, now));
  ASSERT_TRUE(recorder.finish());
  RecordingReader reader;
  ASSERT_EQ(reader.open(path), "");
  std::vector<std::string> topics, names;
  for (Record record; reader.next(record);) {
    topics.push_back(record.topic);
    names.push_back(record.heard.channel());
  }
  EXPECT_EQ(topics, (std::vector<std::string>{"/channel/7", "/channel/7", "/channel/p"}));
  EXPECT_EQ(names, (std::vector<std::string>{"7", "p", "p"}));
}

TEST(RecordClock, TellsOnceThatTheClockWasSetAndMovesNothing) {
  constexpr std::int64_t kHourNs = std::int64_t{3600} * 1'000'000'000;
  RecordClock clock(kHourNs);
  const RecordClock::Steady::time_point time{std::chrono::seconds(5)};
  EXPECT_EQ(clock.was_set(kHourNs + 400'000'000), std::nullopt);
  EXPECT_EQ(clock.was_set(3 * kHourNs), std::chrono::hours(2));
  EXPECT_EQ(clock.was_set(3 * kHourNs), std::nullopt);
  EXPECT_EQ(clock.was_set(0), std::chrono::hours(-3));
  EXPECT_EQ(clock.ns(time), static_cast<std::uint64_t>(kHourNs) + 5'000'000'000u);
}

TEST_F(Recording, AClockThatWasSetIsAFactInTheFile) {
  Recorder recorder;
  ASSERT_EQ(recorder.open(path, "test", false), "");
  ASSERT_TRUE(recorder.heard("a", message_of("1"), now));
  ASSERT_TRUE(recorder.clock_was_set(-std::chrono::seconds(3), now));
  ASSERT_TRUE(recorder.heard("a", message_of("2"), now));
  ASSERT_TRUE(recorder.finish());
  RecordingReader reader;
  ASSERT_EQ(reader.open(path), "");
  int heard = 0;
  for (Record record; reader.next(record);) ++heard;
  EXPECT_EQ(heard, 2);
  EXPECT_EQ(reader.problem(), "");
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  EXPECT_NE(bytes.find("swarmtalk.clock_was_set"), std::string::npos);
  EXPECT_NE(bytes.find("-3000000000"), std::string::npos);
}

TEST_F(Recording, TimeOrderKeepsAnHourOfMessagesWithoutWaitingForItsEnd) {
  Recorder recorder;
  ASSERT_EQ(recorder.open(path, "test", false), "");
  constexpr int kMessages = 3600;
  for (int i = 0; i < kMessages; ++i) {
    ASSERT_TRUE(recorder.heard("a", message_of(std::to_string(i)), now + std::chrono::seconds(i)));
  }
  ASSERT_TRUE(recorder.finish());
  RecordingReader reader;
  ASSERT_EQ(reader.open(path), "");
  int read = 0;
  TimeOrder records(reader, [&](const Record&) { return ++read > 0; });
  Record record;
  for (int i = 0; i < kMessages; ++i) {
    ASSERT_TRUE(records.next(record));
    ASSERT_EQ(record.heard.payload(), std::to_string(i));
    ASSERT_LE(read, i + 2);
  }
  EXPECT_FALSE(records.next(record));
}

TEST_F(Recording, TimeOrderHoldsFewLargeMessages) {
  Recorder recorder;
  ASSERT_EQ(recorder.open(path, "test", false), "");
  const std::string large(1024 * 1024, '\xff');  // packs well
  constexpr int kMessages = 40;
  for (int i = 0; i < kMessages; ++i) ASSERT_TRUE(recorder.heard("a", message_of(large), now));
  ASSERT_TRUE(recorder.finish());
  RecordingReader reader;
  ASSERT_EQ(reader.open(path), "");
  int read = 0;
  TimeOrder records(reader, [&](const Record&) { return ++read > 0; });
  Record record;
  for (int i = 0; i < kMessages; ++i) {
    ASSERT_TRUE(records.next(record));
    EXPECT_EQ(record.heard.payload(), large);
    EXPECT_LE(read, i + 4);
  }
  EXPECT_FALSE(records.next(record));
}

TEST_F(Recording, KeepsLogLinesPosesAndLosses) {
  Recorder recorder;
  ASSERT_EQ(recorder.open(path, "test", false), "");
  swarmtalk::Neighbour neighbour;
  neighbour.node_id = 8;
  neighbour.link = "wifi";
  neighbour.loss = 0.25F;
  swarmtalk::ChannelStatus channel;
  channel.number = 12;
  channel.lost.kernel = 4;
  EXPECT_TRUE(recorder.log_line(message_of("battery low"), now));
  EXPECT_TRUE(recorder.own_pose(3, swarmtalk::Pose{1, -1, 0, milliseconds(0)}, now));
  EXPECT_TRUE(recorder.neighbour(neighbour, now));
  EXPECT_TRUE(recorder.losses(channel, now));
  ASSERT_TRUE(recorder.finish());
  RecordingReader reader;
  ASSERT_EQ(reader.open(path), "");
  Record record;
  ASSERT_TRUE(reader.next(record));
  EXPECT_EQ(record.kind, Record::Kind::kLogLine);
  EXPECT_EQ(record.log_line.text(), "battery low");
  ASSERT_TRUE(reader.next(record));
  EXPECT_TRUE(record.pose.own());
  EXPECT_FLOAT_EQ(record.pose.pose().y_m(), -1);
  ASSERT_TRUE(reader.next(record));
  EXPECT_FALSE(record.pose.has_pose());
  EXPECT_FALSE(record.pose.has_distance_m());
  ASSERT_TRUE(reader.next(record));
  EXPECT_EQ(record.losses.channel(), "12");
  EXPECT_EQ(record.losses.lost().kernel(), 4u);
}

TEST_F(Recording, ClosesItsChunkEachSecond) {
  Recorder recorder;
  ASSERT_EQ(recorder.open(path, "test", false), "");
  ASSERT_TRUE(recorder.heard("a", message_of("x"), now));
  ASSERT_TRUE(recorder.tick(now));
  EXPECT_EQ(recorder.writer().messages(), 0u);
  ASSERT_TRUE(recorder.tick(recorder.next_close()));
  EXPECT_EQ(recorder.writer().messages(), 1u);
}

TEST_F(Recording, ItsSchemaAloneIsEnoughToDecodeIt) {
  Recorder recorder;
  ASSERT_EQ(recorder.open(path, "test", false), "");
  ASSERT_TRUE(recorder.heard("alarm", message_of("fire"), now));
  ASSERT_TRUE(recorder.finish());
  std::ifstream file(path, std::ios::binary);
  McapReader reader(file);
  ASSERT_EQ(reader.open(), "");
  McapMessage message;
  ASSERT_TRUE(reader.next(message));
  const McapSchema* schema = reader.schema(reader.channel(message.channel)->schema);
  ASSERT_NE(schema, nullptr);
  google::protobuf::FileDescriptorSet set;
  ASSERT_TRUE(set.ParseFromString(schema->bytes));
  google::protobuf::DescriptorPool pool;
  for (const auto& each : set.file()) ASSERT_NE(pool.BuildFile(each), nullptr);
  const auto* type = pool.FindMessageTypeByName(schema->name);
  ASSERT_NE(type, nullptr);
  google::protobuf::DynamicMessageFactory factory(&pool);
  const std::unique_ptr<google::protobuf::Message> decoded(factory.GetPrototype(type)->New());
  ASSERT_TRUE(decoded->ParseFromString(std::string(message.bytes)));
  const auto* field = type->FindFieldByName("payload");
  EXPECT_EQ(decoded->GetReflection()->GetString(*decoded, field), "fire");
}

TEST_F(Recording, AFileThatCannotBeReadIsToldWithItsName) {
  RecordingReader missing;
  EXPECT_EQ(missing.open(path), "cannot read " + path + ": No such file or directory");
  RecordingReader wrong;
  EXPECT_EQ(wrong.open(folder), "cannot read " + folder + ": it is not a regular file");
}

}  // namespace
}  // namespace swarmtalk::recording
