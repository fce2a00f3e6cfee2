// The conversation with the page, as docs/view.md says it, without a socket.
#include "view/page_viewer.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "tests/unit/view/told_source.hpp"
#include "tests/unit/view/viewer_answers.hpp"

namespace swarmtalk::view {
namespace {

class Page : public ::testing::Test {
 protected:
  Page() { begin(false); }
  void begin(bool may_operate) {
    viewer_ = std::make_unique<PageViewer>(source_, may_operate);
    viewer_->leave = [this](const std::string& why) { left_ = why; };
    viewer_->wake = [this] { ++wakes_; };
  }
  /// What the page is told in answer to a request; empty: nothing.
  std::string answer(const Json& request) {
    viewer_->on_text(request.dump());
    std::string text;
    for (const Json& each : texts_of(*viewer_)) {
      EXPECT_EQ(each["t"], "notice");
      text += each["text"];
    }
    return text;
  }
  std::vector<Json> show(bool has_info) {
    Scene scene;
    scene.now = kToldSourceNow;
    scene.state = std::make_shared<const std::string>(R"({"t": "state"})");
    if (has_info) scene.info = std::make_shared<const std::string>(R"({"t": "info"})");
    viewer_->show(scene);
    return texts_of(*viewer_);
  }
  void hear(std::uint16_t channel, const std::string& payload) {
    HeardMessage message;
    message.channel = channel;
    message.payload = payload;
    viewer_->on_message(message);
  }

  ToldSource source_;
  std::unique_ptr<PageViewer> viewer_;
  std::string left_;
  int wakes_ = 0;
};

std::vector<Json> kinds(const std::vector<Json>& said) {
  std::vector<Json> kinds;
  for (const Json& each : said) kinds.push_back(each["t"]);
  return kinds;
}

TEST_F(Page, IsGreetedAndToldTheLinesThatAreThere) {
  source_.take_line(7, "one", kToldSourceNow - std::chrono::seconds(2));
  source_.take_line(8, "two", kToldSourceNow);
  viewer_->begin();
  const std::vector<Json> said = texts_of(*viewer_);
  ASSERT_EQ(kinds(said), (std::vector<Json>{"hello", "log", "log"}));
  EXPECT_EQ(said[0]["operate"], false);
  EXPECT_EQ(said[0]["version"], 1);
  EXPECT_EQ(said[1], Json::parse(R"({"t": "log", "k": 1, "from": 7, "text": "one", "age": 2000})"));
  EXPECT_EQ(said[2]["text"], "two");
  EXPECT_EQ(wakes_, 3);
  begin(true);
  viewer_->begin();
  EXPECT_EQ(texts_of(*viewer_)[0]["operate"], true);
}

TEST_F(Page, IsToldEachLineAtOnce) {
  viewer_->on_line({5, 9, "here", kToldSourceNow - std::chrono::milliseconds(30)});
  EXPECT_EQ(texts_of(*viewer_),
            std::vector<Json>{
                Json::parse(R"({"t": "log", "k": 5, "from": 9, "text": "here", "age": 30})")});
  EXPECT_EQ(wakes_, 1);
}

TEST_F(Page, HearsTheChannelThatItWatchesAndNoOther) {
  source_.numbers_ = {{"alarm", 700}, {"701", 701}};
  hear(700, "before");
  EXPECT_EQ(answer({{"op", "watch"}, {"channel", "alarm"}}), "");
  hear(700, "fire");
  hear(701, "other");
  const std::vector<Json> heard = texts_of(*viewer_);
  ASSERT_EQ(heard.size(), 1u);
  EXPECT_EQ(heard[0]["n"], 700);
  EXPECT_EQ(heard[0]["hex"], "66697265");
  // Another one takes its place.
  EXPECT_EQ(answer({{"op", "watch"}, {"channel", 701}}), "");
  EXPECT_EQ(source_.open_, (std::map<std::string, int>{{"701", 1}}));
  hear(700, "fire");
  hear(701, "other");
  EXPECT_EQ(texts_of(*viewer_).size(), 1u);
  EXPECT_EQ(answer({{"op", "unwatch"}}), "");
  EXPECT_TRUE(source_.open_.empty());
  hear(701, "other");
  EXPECT_TRUE(texts_of(*viewer_).empty());
}

TEST_F(Page, HearsAChannelWhoseNumberIsKnownLater) {
  EXPECT_EQ(answer({{"op", "watch"}, {"channel", "late"}}), "");
  hear(9, "too early");
  EXPECT_TRUE(texts_of(*viewer_).empty());
  source_.numbers_["late"] = 9;
  show(false);
  hear(9, "now");
  EXPECT_EQ(kinds(texts_of(*viewer_)), std::vector<Json>{"msg"});
}

TEST_F(Page, ClosesItsChannelWhenItGoes) {
  EXPECT_EQ(answer({{"op", "watch"}, {"channel", "alarm"}}), "");
  EXPECT_EQ(source_.open_.at("alarm"), 1);
  viewer_.reset();
  EXPECT_TRUE(source_.open_.empty());
}

TEST_F(Page, IsToldWhyAChannelCannotBeListenedTo) {
  source_.refused_["full"] = Status(StatusCode::kLimit, "no room");
  EXPECT_EQ(answer({{"op", "watch"}, {"channel", "good"}}), "");
  EXPECT_EQ(answer({{"op", "watch"}, {"channel", "full"}}),
            "channel full cannot be listened to: no room");
  EXPECT_TRUE(source_.open_.empty()) << "the one before was closed";
  EXPECT_EQ(answer({{"op", "unwatch"}}), "") << "nothing is closed twice";
  EXPECT_TRUE(source_.open_.empty());
}

TEST_F(Page, SendsOnlyWhereItIsAllowed) {
  const Json request{{"op", "publish"}, {"channel", "go"}, {"text", "now"}};
  EXPECT_EQ(answer(request), "this viewer only looks: start swarmtalk-view with --operate");
  EXPECT_TRUE(source_.sent_.empty());
  begin(true);
  EXPECT_EQ(answer(request), "sent on channel go");
  EXPECT_EQ(answer({{"op", "publish"}, {"channel", 65535}, {"text", ""}}), "sent on channel 65535");
  using Sent = std::pair<std::string, std::string>;
  EXPECT_EQ(source_.sent_, (std::vector<Sent>{{"go", "now"}, {"65535", ""}}));
  source_.publishes_ = Status(StatusCode::kTooLong, "99 bytes at most");
  EXPECT_EQ(answer(request), "99 bytes at most");
}

TEST_F(Page, IsToldTheCardThatIsOpenWithEachInfo) {
  source_.known().note_sign(7, kToldSourceNow);
  EXPECT_EQ(kinds(show(true)), (std::vector<Json>{"state", "info"}));
  EXPECT_EQ(answer({{"op", "card"}, {"robot", 7}}), "");
  EXPECT_EQ(source_.wanted_, std::vector<std::uint32_t>{7});
  EXPECT_EQ(kinds(show(false)), std::vector<Json>{"state"});
  const std::vector<Json> said = show(true);
  ASSERT_EQ(kinds(said), (std::vector<Json>{"state", "info", "card"}));
  EXPECT_EQ(said[2]["id"], 7);
  EXPECT_EQ(said[2]["known"], true);
  EXPECT_EQ(answer({{"op", "card"}, {"robot", 65535}}), "");
  EXPECT_EQ(show(true).at(2), Json::parse(R"({"t": "card", "id": 65535, "known": false})"));
  EXPECT_EQ(answer({{"op", "card"}, {"robot", 0}}), "");
  EXPECT_EQ(source_.wanted_, (std::vector<std::uint32_t>{7, 65535})) << "0: nobody's";
  EXPECT_EQ(kinds(show(true)), (std::vector<Json>{"state", "info"}));
}

TEST_F(Page, IsToldOnceHowMuchWasDroppedForIt) {
  for (std::size_t i = 0; i < SendQueue::kMostEvents + 3; ++i) viewer_->on_line({});
  show(false);
  Scene scene;
  scene.state = std::make_shared<const std::string>("{}");
  viewer_->show(scene);
  viewer_->show(scene);
  const std::vector<Json> said = show(true);
  const Json dropped = said.back();
  EXPECT_EQ(dropped, Json::parse(R"({"t": "dropped", "events": 3, "states": 2})"));
  EXPECT_EQ(kinds(show(true)), (std::vector<Json>{"state", "info"}));
  for (std::size_t i = 0; i < SendQueue::kMostEvents + 1; ++i) viewer_->on_line({});
  texts_of(*viewer_);
  EXPECT_EQ(show(true).back(), Json::parse(R"({"t": "dropped", "events": 4, "states": 2})"));
}

TEST_F(Page, IsToldWhatARequestLacks) {
  begin(true);
  const char* const kNoObject = "a request is a JSON object with \"op\"";
  const char* const kNoChannel = "a channel is a name, or a number from 0 to 65535";
  const char* const kNoCard = "\"card\" takes \"robot\", a node id; 0: none";
  const char* const kNoPublish = "\"publish\" takes \"channel\" and \"text\"";
  const char* const kNoRecording = "this is no recording: its time cannot be moved";
  const std::pair<const char*, const char*> bad[] = {
      {"[]", kNoObject},
      {"{", kNoObject},
      {R"({"op": 1})", kNoObject},
      {R"({"a": 1})", kNoObject},
      {R"({"op": "dance"})", "there is no request of that name"},
      {R"({"op": "watch"})", "\"watch\" takes \"channel\", a name or a number"},
      {R"({"op": "watch", "channel": []})", "\"watch\" takes \"channel\", a name or a number"},
      {R"({"op": "watch", "channel": 65536})", kNoChannel},
      {R"({"op": "watch", "channel": "-1"})", kNoChannel},
      {R"({"op": "watch", "channel": "+1"})", kNoChannel},
      {R"({"op": "publish", "channel": "100000", "text": ""})", kNoChannel},
      {R"({"op": "card"})", kNoCard},
      {R"({"op": "card", "robot": 65536})", kNoCard},
      {R"({"op": "card", "robot": -1})", kNoCard},
      {R"({"op": "publish", "text": "x"})", kNoPublish},
      {R"({"op": "publish", "channel": "x"})", kNoPublish},
      {R"({"op": "publish", "channel": "x", "text": 1})", kNoPublish},
      {R"({"op": "play"})", kNoRecording},
      {R"({"op": "pause"})", kNoRecording},
      {R"({"op": "seek", "at": 1})", kNoRecording},
      {R"({"op": "speed", "times": 1})", kNoRecording}};
  for (const auto& [request, why] : bad) {
    begin(true);
    viewer_->on_text(request);
    const std::vector<Json> said = texts_of(*viewer_);
    ASSERT_EQ(said.size(), 1u) << request;
    EXPECT_EQ(said[0], (Json{{"t", "notice"}, {"text", why}})) << request;
  }
  EXPECT_TRUE(source_.open_.empty() && source_.sent_.empty() && source_.wanted_.empty());
  // A sign alone, or with letters, is a name.
  EXPECT_EQ(answer({{"op", "watch"}, {"channel", "-"}}), "");
  EXPECT_EQ(answer({{"op", "watch"}, {"channel", "-a"}}), "");
}

TEST_F(Page, IsLeftAfterSixteenRequestsThatMakeNoSense) {
  for (unsigned i = 1; i < PageViewer::kMostBadRequests; ++i) {
    EXPECT_EQ(answer({{"op", "dance"}}), "there is no request of that name");
    EXPECT_EQ(answer({{"op", "unwatch"}}), "") << "does not count";
  }
  EXPECT_EQ(left_, "");
  viewer_->on_binary("{}");
  EXPECT_EQ(left_, "too many bad requests; the last: requests are JSON texts, not binary");
  EXPECT_TRUE(texts_of(*viewer_).empty());
}

}  // namespace
}  // namespace swarmtalk::view
