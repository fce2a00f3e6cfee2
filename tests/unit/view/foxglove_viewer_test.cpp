// The conversation with Lichtblick or Foxglove without a socket. Layout of the binary messages: the
// Foxglove WebSocket protocol, "message data" and "time".
#include "view/foxglove_viewer.hpp"

#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>
#include <sodium.h>

#include "tests/unit/view/told_source.hpp"
#include "tests/unit/view/viewer_answers.hpp"
#include "view/scene/foxglove.pb.h"

namespace swarmtalk::view {
namespace {

constexpr std::uint64_t kShownNs = 0x1122334455667788;
const std::string kShownBytes = "\x88\x77\x66\x55\x44\x33\x22\x11";

class Foxglove : public ::testing::Test {
 protected:
  Foxglove() {
    source_.wall_ns_ = kShownNs;
    viewer_.leave = [this](const std::string& why) { left_ = why; };
  }
  void ask(const Json& request) { viewer_.on_text(request.dump()); }
  void subscribe(unsigned id, unsigned channel) {
    ask({{"op", "subscribe"}, {"subscriptions", {{{"id", id}, {"channelId", channel}}}}});
  }
  /// What is refused, in words.
  std::string refusal() {
    std::string text;
    for (const Json& each : texts_of(viewer_)) {
      EXPECT_EQ(each["op"], "status");
      EXPECT_EQ(each["level"], 2);
      text += each["message"];
    }
    return text;
  }
  std::vector<std::string> warnings(bool has_info = true) {
    Scene scene;
    if (has_info) scene.info = std::make_shared<const std::string>("{}");
    viewer_.show(scene);
    std::vector<std::string> told;
    for (const Json& each : texts_of(viewer_)) {
      EXPECT_EQ(each["level"], 1);
      told.push_back(each["message"]);
    }
    return told;
  }
  /// The binary messages of a turn, whose pictures are "scene", "tf", "robots".
  std::vector<std::string> show() {
    Scene scene;
    scene.wall_ns = kShownNs;
    const char* const pictures[] = {"scene", "tf", "robots"};
    for (std::size_t i = 0; i < 3; ++i) {
      scene.pictures[i] = std::make_shared<const std::string>(pictures[i]);
    }
    viewer_.show(scene);
    std::vector<std::string> shown;
    for (const Outgoing& each : all_of(viewer_)) {
      EXPECT_TRUE(each.is_binary);
      shown.push_back(*each.bytes);
    }
    return shown;
  }

  ToldSource source_;
  FoxgloveViewer viewer_{source_};
  std::string left_;
};

TEST_F(Foxglove, IsToldWhatThereIsWithItsSchemas) {
  viewer_.begin();
  const std::vector<Json> said = texts_of(viewer_);
  ASSERT_EQ(said.size(), 2u);
  EXPECT_EQ(said[0], Json::parse(R"({"op": "serverInfo", "name": "swarmtalk-view",
                                     "capabilities": [], "metadata": {}})"));
  EXPECT_EQ(said[1]["op"], "advertise");
  const std::pair<const char*, const char*> topics[] = {{"/swarm", "foxglove.SceneUpdate"},
                                                        {"/tf", "foxglove.FrameTransforms"},
                                                        {"/robots", "swarmtalk.Robots"},
                                                        {"/log", "foxglove.Log"}};
  ASSERT_EQ(said[1]["channels"].size(), std::size(topics));
  for (std::size_t i = 0; i < std::size(topics); ++i) {
    const Json& channel = said[1]["channels"][i];
    EXPECT_EQ(channel["id"], i + 1);
    EXPECT_EQ(channel["topic"], topics[i].first);
    EXPECT_EQ(channel["schemaName"], topics[i].second);
    EXPECT_EQ(channel["encoding"], "protobuf");
    EXPECT_EQ(channel["schemaEncoding"], "protobuf");
    const std::string text = channel["schema"];
    std::string bytes(text.size(), '\0');
    std::size_t size = 0;
    ASSERT_EQ(
        sodium_base642bin(reinterpret_cast<unsigned char*>(bytes.data()), bytes.size(), text.data(),
                          text.size(), nullptr, &size, nullptr, sodium_base64_VARIANT_ORIGINAL),
        0);
    google::protobuf::FileDescriptorSet files;
    EXPECT_TRUE(files.ParseFromArray(bytes.data(), static_cast<int>(size)));
    EXPECT_GT(files.file_size(), 0);
  }
}

TEST_F(Foxglove, IsShownWhatItSubscribedToUnderItsId) {
  EXPECT_TRUE(show().empty());
  EXPECT_FALSE(viewer_.wants_pictures());
  subscribe(0x01020304, 3);
  subscribe(5, 1);
  EXPECT_TRUE(viewer_.wants_pictures());
  EXPECT_EQ(show(),
            (std::vector<std::string>{"\x01\x04\x03\x02\x01" + kShownBytes + "robots",
                                      std::string("\x01\x05\0\0\0", 5) + kShownBytes + "scene"}));
  // Of a turn that is not written in time, nothing is left beside the newest.
  Scene old;
  old.pictures[0] = std::make_shared<const std::string>("old");
  viewer_.show(old);
  EXPECT_EQ(show().size(), 2u);
  ask({{"op", "unsubscribe"}, {"subscriptionIds", {0x01020304, 77}}});
  EXPECT_EQ(show(),
            std::vector<std::string>{std::string("\x01\x05\0\0\0", 5) + kShownBytes + "scene"});
  ask({{"op", "unsubscribe"}, {"subscriptionIds", {5}}});
  EXPECT_TRUE(show().empty());
  EXPECT_FALSE(viewer_.wants_pictures());
}

TEST_F(Foxglove, LinesComeToWhoSubscribedToThemWithTheTimeTheyWereSaid) {
  source_.take_line(7, "before", kToldSourceNow - std::chrono::nanoseconds(0x88));
  viewer_.on_line(source_.traffic().lines().back());
  EXPECT_TRUE(all_of(viewer_).empty());
  subscribe(1, 2);
  subscribe(2, 4);
  EXPECT_FALSE([&] {
    ask({{"op", "unsubscribe"}, {"subscriptionIds", {1}}});
    return viewer_.wants_pictures();
  }()) << "lines are no picture";
  viewer_.on_line({2, 8, "after", kToldSourceNow});
  std::vector<std::pair<std::string, std::uint64_t>> said;
  for (const Outgoing& each : all_of(viewer_)) {
    EXPECT_TRUE(each.is_binary);
    EXPECT_EQ(each.bytes->substr(0, 5), std::string("\x01\x02\0\0\0", 5));
    foxglove::Log line;
    ASSERT_TRUE(line.ParseFromString(each.bytes->substr(13)));
    const std::uint64_t at_ns =
        static_cast<std::uint64_t>(line.timestamp().seconds()) * 1000000000u +
        static_cast<std::uint64_t>(line.timestamp().nanos());
    std::uint64_t head_ns = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      head_ns |= std::uint64_t{static_cast<unsigned char>((*each.bytes)[5 + i])} << (8 * i);
    }
    EXPECT_EQ(head_ns, at_ns);
    said.emplace_back(line.name() + ": " + line.message(), at_ns);
  }
  using Line = std::pair<std::string, std::uint64_t>;
  EXPECT_EQ(said, (std::vector<Line>{{"robot/7: before", kShownNs - 0x88},
                                     {"robot/8: after", kShownNs}}));
}

TEST_F(Foxglove, IsToldWhatARequestLacks) {
  const char* const kOnlyShows = "swarmtalk-view only shows: it takes subscribe and unsubscribe";
  const char* const kNoSubscription = "a subscription has id and channelId";
  const std::pair<const char*, const char*> bad[] = {
      {"[]", "a request is a JSON object with op"},
      {"{", "a request is a JSON object with op"},
      {"{}", "a request is a JSON object with op"},
      {R"({"op": "advertise"})", kOnlyShows},
      {R"({"op": 1})", kOnlyShows},
      {R"({"op": "subscribe", "subscriptions": [1]})", kNoSubscription},
      {R"({"op": "subscribe", "subscriptions": [{"id": 1}]})", kNoSubscription},
      {R"({"op": "subscribe", "subscriptions": [{"channelId": 1}]})", kNoSubscription},
      {R"({"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 1}]})", kNoSubscription},
      {R"({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 0}]})",
       "there is no such channel"},
      {R"({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 5}]})",
       "there is no such channel"},
      {R"({"op": "subscribe", "subscriptions": [{"id": 4294967296, "channelId": 1}]})",
       "there is no such channel"}};
  for (const auto& [request, why] : bad) {
    FoxgloveViewer viewer(source_);
    viewer.on_text(request);
    EXPECT_EQ(texts_of(viewer),
              std::vector<Json>{(Json{{"op", "status"}, {"level", 2}, {"message", why}})})
        << request;
    EXPECT_FALSE(viewer.wants_pictures());
  }
  subscribe(4294967295, 1);
  subscribe(4294967295, 2);
  EXPECT_EQ(refusal(), "this subscription id is in use");
  for (unsigned id = 1; id < FoxgloveViewer::kMostSubscriptions; ++id) subscribe(id, 1);
  EXPECT_EQ(refusal(), "");
  subscribe(99, 1);
  EXPECT_EQ(refusal(), "at most 8 subscriptions are open at a time");
  EXPECT_EQ(show().size(), 8u);
  ask({{"op", "unsubscribe"}, {"subscriptionIds", {3}}});
  subscribe(99, 1);
  EXPECT_EQ(refusal(), "");
}

TEST_F(Foxglove, IsLeftAfterSixteenRequestsThatMakeNoSense) {
  for (unsigned i = 1; i < FoxgloveViewer::kMostBadRequests; ++i) {
    viewer_.on_binary("x");
    EXPECT_EQ(refusal(), "swarmtalk-view only shows: it takes no messages of a client");
    EXPECT_EQ(left_, "");
  }
  viewer_.on_text("{}");
  EXPECT_EQ(left_, "too many bad requests; the last: a request is a JSON object with op");
}

TEST_F(Foxglove, IsToldOnceOfEachChannelThatIsLeftOutAndAgainAfterItWasHeard) {
  using Told = std::vector<std::string>;
  source_.left_out_ = {{"a", "no room"}};
  EXPECT_EQ(warnings(false), Told());
  EXPECT_EQ(warnings(), Told{"channel a is left out: no room"});
  EXPECT_EQ(warnings(), Told());
  source_.left_out_["b"] = "refused";
  EXPECT_EQ(warnings(), Told{"channel b is left out: refused"});
  source_.left_out_.erase("a");
  EXPECT_EQ(warnings(), Told());
  source_.left_out_["a"] = "no room";
  EXPECT_EQ(warnings(), Told{"channel a is left out: no room"});
}

TEST_F(Foxglove, IsToldOnceHowManyLinesWereDroppedForIt) {
  subscribe(1, 4);
  for (std::size_t i = 0; i <= SendQueue::kMostEvents; ++i) viewer_.on_line({});
  all_of(viewer_);
  using Told = std::vector<std::string>;
  EXPECT_EQ(warnings(false), Told());
  EXPECT_EQ(warnings(), Told{"1 log line was dropped: this viewer reads too slowly"});
  EXPECT_EQ(warnings(), Told());
  for (std::size_t i = 0; i <= SendQueue::kMostEvents; ++i) viewer_.on_line({});
  all_of(viewer_);
  EXPECT_EQ(warnings(), Told{"2 log lines were dropped: this viewer reads too slowly"});
}

TEST_F(Foxglove, HasNoTimeOfItsOwnUnlessItIsARecording) {
  viewer_.on_jump();
  EXPECT_TRUE(all_of(viewer_).empty());
}

}  // namespace
}  // namespace swarmtalk::view
