// All who look are shown the same, for as long as somebody looks.
#include "view/stage.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "tests/support/patience.hpp"
#include "tests/unit/view/told_source.hpp"
#include "view/foxglove_viewer.hpp"
#include "view/page_viewer.hpp"

namespace swarmtalk::view {
namespace {

class WatchedSource : public ToldSource {
 public:
  void set_watched(bool is_watched) override { is_watched_ = is_watched; }
  bool is_watched_ = false;
};

class Onlooker : public Viewer {
 public:
  Onlooker() {
    wake = [this] { ++wakes_; };
  }
  void begin() override {}
  void on_text(std::string_view) override {}
  void on_binary(std::string_view) override {}
  void show(const Scene& scene) override { shown_.push_back(scene); }
  void on_message(const HeardMessage& message) override { heard_.push_back(message.payload); }
  void on_line(const LogLine& line) override { heard_.push_back(line.text); }
  void on_jump() override { heard_.push_back("jump"); }
  bool wants_pictures() const override { return wants_pictures_; }

  std::vector<Scene> shown_;
  std::vector<std::string> heard_;
  bool wants_pictures_ = false;
  int wakes_ = 0;
};

class StageTest : public ::testing::Test {
 protected:
  /// Until this one was shown so much.
  void run_until(const Onlooker& viewer, std::size_t shown) {
    while (viewer.shown_.size() < shown) {
      ASSERT_NE(io_.run_one_for(test::kPatience), 0u) << "nothing is shown";
    }
  }

  WatchedSource source_;
  boost::asio::io_context io_;
  Stage stage_{io_, source_, true};
};

TEST_F(StageTest, AllAreToldOfMessagesLinesAndJumps) {
  Onlooker one, other, gone;
  for (Onlooker* each : {&one, &other, &gone}) stage_.add(*each);
  EXPECT_EQ(stage_.viewers(), 3u);
  stage_.remove(gone);
  EXPECT_EQ(stage_.viewers(), 2u);
  Message message;
  message.payload = "message";
  source_.take_message(message, kToldSourceNow);
  source_.take_line(2, "line", kToldSourceNow);
  source_.on_jump();
  const std::vector<std::string> all{"message", "line", "jump"};
  EXPECT_EQ(one.heard_, all);
  EXPECT_EQ(other.heard_, all);
  EXPECT_TRUE(gone.heard_.empty());
}

TEST_F(StageTest, StatesComeEachTurnInfosEachTenthAndANewcomerSeesAllInTheNext) {
  source_.wall_ns_ = 77;
  source_.known().note_sign(5, kToldSourceNow);
  Onlooker first;
  stage_.add(first);
  EXPECT_TRUE(source_.is_watched_);
  run_until(first, 13);
  for (std::size_t i = 0; i < first.shown_.size(); ++i) {
    const Scene& scene = first.shown_[i];
    EXPECT_TRUE(scene.state && scene.state->find("\"id\":5") != std::string::npos);
    EXPECT_EQ(scene.info != nullptr, i == 0 || i == 10) << i;
    EXPECT_EQ(scene.wall_ns, 77u);
    EXPECT_EQ(scene.now, kToldSourceNow);
    EXPECT_EQ(scene.pictures[0], nullptr) << "nobody wants them";
  }
  EXPECT_EQ(first.wakes_, 13);
  Onlooker second;
  second.wants_pictures_ = true;
  stage_.add(second);
  run_until(second, 2);
  EXPECT_EQ(first.shown_.size(), 15u);
  EXPECT_TRUE(second.shown_[0].info);
  EXPECT_FALSE(second.shown_[1].info);
  EXPECT_TRUE(second.shown_[0].pictures[0]);
  EXPECT_EQ(first.shown_[13].state, second.shown_[0].state) << "made once for all";
}

TEST_F(StageTest, NothingIsMadeWhileNobodyLooksAndItGoesOnWhenOneComesBack) {
  Onlooker viewer;
  stage_.add(viewer);
  run_until(viewer, 1);
  stage_.remove(viewer);
  EXPECT_FALSE(source_.is_watched_);
  io_.run_for(test::kPatience);  // ends, since nothing is waited for any more
  EXPECT_TRUE(io_.stopped());
  EXPECT_EQ(viewer.shown_.size(), 1u);
  io_.restart();
  stage_.add(viewer);
  EXPECT_TRUE(source_.is_watched_);
  run_until(viewer, 2);
  EXPECT_TRUE(viewer.shown_[1].info);
}

TEST_F(StageTest, ASubprotocolOfFoxgloveBringsItsViewerAndAnyOtherThePage) {
  const auto is_foxglove = [&](std::string_view subprotocol) {
    return dynamic_cast<FoxgloveViewer*>(stage_.make_viewer(subprotocol).get()) != nullptr;
  };
  EXPECT_TRUE(is_foxglove("foxglove.websocket.v1"));
  EXPECT_TRUE(is_foxglove("foxglove.sdk.v1"));
  EXPECT_FALSE(is_foxglove("swarmtalk.view.v1"));
  EXPECT_FALSE(is_foxglove(""));
}

}  // namespace
}  // namespace swarmtalk::view
