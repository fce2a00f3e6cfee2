// A recording as a source: what is shown at a time is what was recorded up to it, however one got
// there; what is cut or broken is told.
#include "view/playback.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "recording/topic_writer.hpp"
#include "view/page_viewer.hpp"
#include "view/swarm_json.hpp"

namespace swarmtalk::view {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint64_t kBeginNs = 1'700'000'000'000'000'000;
constexpr int kSeconds = 300;

class PlaybackOfAFile : public ::testing::Test {
 protected:
  PlaybackOfAFile() {
    std::string name = "/tmp/swarmtalk-playback-XXXXXX";
    folder = ::mkdtemp(name.data());
    path = folder + "/run.mcap";
  }
  ~PlaybackOfAFile() override { std::filesystem::remove_all(folder); }

  /// Robot 1 records; robot 2 runs along x at 0.1 m/s and publishes each second; robot 3 is there
  /// for the first 20 s. A chunk each five seconds.
  void write_run() {
    recording::TopicWriter topics;
    ASSERT_EQ(topics.writer().open(path, "test", true), "");
    for (int second = 0; second <= kSeconds; ++second) {
      const std::uint64_t at_ns = kBeginNs + static_cast<std::uint64_t>(second) * 1'000'000'000;
      recording::RobotPose own;
      own.set_robot(1);
      own.set_own(true);
      own.mutable_pose()->set_x_m(-1);
      topics.write("/pose", own, at_ns);
      recording::RobotPose other;
      other.set_robot(2);
      other.set_loss(0.25F);
      other.mutable_pose()->set_x_m(0.1F * static_cast<float>(second));
      topics.write("/pose", other, at_ns);
      if (second <= 20) {
        other.set_robot(3);
        topics.write("/pose", other, at_ns);
      }
      recording::HeardMessage heard;
      heard.set_channel("alarm");
      heard.set_channel_number(700);
      heard.set_sender(2);
      heard.set_payload("fire " + std::to_string(second));
      heard.set_hops(0);
      topics.write("/channel/alarm", heard, at_ns);
      recording::LogLine line;
      line.set_robot(2);
      line.set_text("second " + std::to_string(second));
      topics.write("/log_lines", line, at_ns + 1);
      if (second % 5 == 4) {
        ASSERT_TRUE(topics.writer().close_chunk());
      }
    }
    ASSERT_TRUE(topics.writer().finish());
  }

  static float x_of(const Playback& playback, std::uint32_t id) {
    const SwarmRobot* const robot = playback.swarm().find(id);
    return robot != nullptr && robot->place ? robot->place->x_m : NAN;
  }
  static void go_to(Playback& playback, milliseconds at) {
    playback.seek(at);
    playback.pass(milliseconds(0));
  }

  std::string folder;
  std::string path;
  boost::asio::io_context io;
};

TEST_F(PlaybackOfAFile, GoesOnWithTheTimeThatPassesTimesItsSpeed) {
  write_run();
  Playback playback(io);
  ASSERT_EQ(playback.open(path), "");
  EXPECT_EQ(playback.length(), seconds(kSeconds) + milliseconds(0));
  EXPECT_EQ(playback.at(), milliseconds(0));
  EXPECT_EQ(playback.wall_ns(), kBeginNs);
  std::vector<std::string> heard;
  playback.on_message = [&](const HeardMessage& message) { heard.push_back(message.payload); };
  for (int i = 0; i < 20; ++i) playback.pass(milliseconds(50));
  EXPECT_EQ(playback.at(), seconds(1));
  EXPECT_EQ(heard, std::vector<std::string>{"fire 1"});
  EXPECT_FLOAT_EQ(x_of(playback, 2), 0.1F);
  playback.set_speed(10);
  for (int i = 0; i < 20; ++i) playback.pass(milliseconds(50));
  EXPECT_EQ(playback.at(), seconds(11));
  EXPECT_EQ(heard.size(), 11u);
  EXPECT_FLOAT_EQ(x_of(playback, 2), 1.1F);
  playback.pause();
  playback.pass(seconds(1));
  EXPECT_EQ(playback.at(), seconds(11));
}

TEST_F(PlaybackOfAFile, AJumpShowsTheSameAsTheWayThere) {
  write_run();
  Playback walked(io), jumped(io);
  ASSERT_EQ(walked.open(path), "");
  ASSERT_EQ(jumped.open(path), "");
  walked.set_speed(1);
  for (int i = 0; i < 250; ++i) walked.pass(seconds(1));
  go_to(jumped, seconds(280));
  go_to(jumped, seconds(250));
  EXPECT_EQ(swarm_state_json(walked.swarm(), walked.now()),
            swarm_state_json(jumped.swarm(), jumped.now()));
  EXPECT_FLOAT_EQ(x_of(jumped, 2), 25.0F);
  EXPECT_EQ(jumped.traffic().lines().back().text, "second 249");  // 250's is a moment later
  EXPECT_EQ(walked.traffic().lines().back().text, "second 249");
}

TEST_F(PlaybackOfAFile, AJumpToItsEndShowsTheLastRecord) {
  write_run();
  Playback playback(io);
  ASSERT_EQ(playback.open(path), "");
  go_to(playback, playback.length());
  EXPECT_EQ(playback.traffic().lines().back().text, "second 300");  // 1 ns behind the last second
}

/// Texts that a page's window of messages is told all at once, the last time that it is.
std::vector<std::string> window_of(PageViewer& page) {
  std::vector<std::string> texts;
  while (const auto told = page.queue.take()) {
    const auto json = nlohmann::json::parse(*told->bytes);
    if (json["t"] != "msgs") continue;
    texts.clear();
    for (const auto& each : json["list"]) {
      const std::string hex = each["hex"];
      texts.emplace_back();
      for (std::size_t i = 0; i < hex.size(); i += 2) {
        texts.back() += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
      }
    }
  }
  return texts;
}

TEST_F(PlaybackOfAFile, AWindowOfMessagesShowsAfterAJumpWhatLedThere) {
  write_run();
  Playback playback(io);
  ASSERT_EQ(playback.open(path), "");
  PageViewer page(playback, false);
  playback.on_jump = [&] { page.on_jump(); };
  page.on_text(R"({"op":"watch","channel":"alarm"})");
  EXPECT_EQ(window_of(page), std::vector<std::string>{"fire 0"});
  go_to(playback, playback.length());
  const auto at_end = window_of(page);
  ASSERT_GE(at_end.size(), 100u);
  EXPECT_EQ(at_end.back(), "fire 300");
  EXPECT_EQ(at_end[at_end.size() - 100], "fire 201");
  go_to(playback, seconds(3));
  EXPECT_EQ(window_of(page), (std::vector<std::string>{"fire 0", "fire 1", "fire 2", "fire 3"}));
  PageViewer later(playback, false);  // opens its window while the time stands still
  later.on_text(R"({"op":"watch","channel":700})");
  EXPECT_EQ(window_of(later).size(), 4u);
}

TEST_F(PlaybackOfAFile, AfterAJumpItIsSaidFromWhenOnItIsKnown) {
  write_run();
  Playback playback(io);
  ASSERT_EQ(playback.open(path), "");
  EXPECT_EQ(playback.known_since(), milliseconds(0));
  go_to(playback, seconds(280));
  const milliseconds since = playback.known_since();
  EXPECT_GT(since, seconds(150));
  EXPECT_LE(since, seconds(160)) << "two minutes at least";
  EXPECT_EQ(nlohmann::json::parse(state_json(playback))["play"]["since"], since.count());
  playback.pass(seconds(1));
  EXPECT_EQ(playback.known_since(), since) << "nothing is forgotten";
  go_to(playback, seconds(100));
  EXPECT_EQ(playback.known_since(), milliseconds(0)) << "it is read from its beginning";
}

TEST_F(PlaybackOfAFile, AChannelCanBeOpenedBeforeItsFirstMessage) {
  recording::TopicWriter topics;
  ASSERT_EQ(topics.writer().open(path, "test", true), "");
  recording::RobotPose pose;
  pose.set_robot(2);
  topics.write("/pose", pose, kBeginNs);
  recording::HeardMessage heard;
  heard.set_channel("late");
  heard.set_channel_number(900);
  topics.write("/channel/late", heard, kBeginNs + 1'000'000'000);
  ASSERT_TRUE(topics.writer().finish());
  Playback playback(io);
  ASSERT_EQ(playback.open(path), "");
  PageViewer page(playback, false);
  playback.on_message = [&](const HeardMessage& message) { page.on_message(message); };
  page.on_text(R"({"op":"watch","channel":"late"})");
  page.queue.take();  // an empty window
  playback.pass(seconds(1));
  const auto told = nlohmann::json::parse(*page.queue.take()->bytes);
  EXPECT_EQ(told["n"], 900);
  EXPECT_FALSE(told.contains("hops"));  // are not known
  EXPECT_TRUE(playback.open_channel("late"));
  EXPECT_TRUE(playback.open_channel("900"));
  EXPECT_FALSE(playback.open_channel("never"));
}

TEST_F(PlaybackOfAFile, WhoWantsToSendIntoItIsToldWhatItIs) {
  write_run();
  Playback playback(io);
  ASSERT_EQ(playback.open(path), "");
  PageViewer page(playback, false);
  page.on_text(R"({"op":"publish","channel":"alarm","text":"fire"})");
  const auto told = page.queue.take();
  ASSERT_TRUE(told);
  EXPECT_NE(told->bytes->find("this is a recording"), std::string::npos) << *told->bytes;
}

TEST_F(PlaybackOfAFile, ARobotThatFellSilentIsOlderAndThenForgotten) {
  write_run();
  Playback playback(io);
  ASSERT_EQ(playback.open(path), "");
  go_to(playback, seconds(30));
  const SwarmRobot* const gone = playback.swarm().find(3);
  ASSERT_NE(gone, nullptr);
  EXPECT_EQ(playback.now() - *last_sign(*gone), seconds(10));
  go_to(playback, seconds(139));
  EXPECT_NE(playback.swarm().find(3), nullptr);
  go_to(playback, seconds(141));
  EXPECT_EQ(playback.swarm().find(3), nullptr);
  go_to(playback, seconds(19));
  EXPECT_EQ(playback.now() - *last_sign(*playback.swarm().find(3)), seconds(0));
}

TEST_F(PlaybackOfAFile, AJumpTellsNoMessagesAndOneJumpWithTheWayThere) {
  write_run();
  Playback playback(io);
  ASSERT_EQ(playback.open(path), "");
  int messages = 0, jumps = 0;
  playback.on_message = [&](const HeardMessage&) { ++messages; };
  playback.on_jump = [&] { ++jumps; };
  playback.seek(seconds(10));
  go_to(playback, seconds(100));  // of two wishes the last
  EXPECT_EQ(messages, 0);
  EXPECT_EQ(jumps, 1);
  ASSERT_EQ(playback.trail().size(), 24u);
  EXPECT_EQ(playback.trail().front().at, seconds(88));
  EXPECT_FLOAT_EQ(playback.trail().front().spots.at(1).x_m, 8.8F);
  playback.pass(seconds(1));
  EXPECT_EQ(messages, 1);
}

TEST_F(PlaybackOfAFile, StopsAtItsEndAndPlaysFromTheBeginningAgain) {
  write_run();
  Playback playback(io);
  ASSERT_EQ(playback.open(path), "");
  go_to(playback, std::chrono::hours(1));
  EXPECT_EQ(playback.at(), playback.length());
  playback.pass(milliseconds(50));
  EXPECT_FALSE(playback.is_playing());
  playback.play();
  playback.pass(milliseconds(50));
  playback.pass(milliseconds(500));
  EXPECT_EQ(playback.at(), milliseconds(500));
  EXPECT_TRUE(playback.is_playing());
}

TEST_F(PlaybackOfAFile, AFileThatIsCutAnywherePlaysWhatIsWhole) {
  write_run();
  std::string bytes;
  {
    std::ifstream file(path, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(file), {});
  }
  std::uint32_t seed = 20;
  for (int i = 0; i < 40; ++i) {
    seed = seed * 1664525 + 1013904223;
    const std::size_t left = seed % bytes.size();
    std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes.substr(0, left);
    Playback playback(io);
    if (const std::string problem = playback.open(path); !problem.empty()) {
      EXPECT_LT(left, 6000u) << problem;  // not even the first chunk
      continue;
    }
    EXPECT_NE(playback.problem(), "") << left;
    EXPECT_EQ(playback.problem().find('\n'), std::string::npos);
    go_to(playback, playback.length());
    const auto second = std::chrono::duration<float>(playback.length()).count();
    EXPECT_NEAR(x_of(playback, 2), 0.1F * second, 0.001F);
  }
}

TEST_F(PlaybackOfAFile, WhatIsNoRecordingIsToldInOneSentence) {
  std::ofstream(path) << "not a recording at all";
  Playback text(io);
  EXPECT_EQ(text.open(path), path + ": it is not an MCAP file: its first bytes are others");
  recording::McapWriter writer;
  ASSERT_EQ(writer.open(path, "test", true), "");
  ASSERT_TRUE(writer.finish());
  Playback empty(io);
  EXPECT_EQ(empty.open(path), path + ": it holds no records of swarmtalk-cli record");
  Playback missing(io);
  EXPECT_EQ(missing.open(folder + "/no"),
            "cannot read " + folder + "/no: No such file or directory");
}

TEST_F(PlaybackOfAFile, ThePageMovesItsTime) {
  write_run();
  Playback playback(io);
  ASSERT_EQ(playback.open(path), "");
  PageViewer page(playback, false);
  page.on_text(R"({"op":"seek","at":42000})");
  playback.pass(milliseconds(0));
  EXPECT_EQ(playback.at(), seconds(42));
  page.on_text(R"({"op":"speed","times":1e9})");
  EXPECT_EQ(playback.speed(), Playback::kMostSpeed);
  page.on_text(R"({"op":"pause"})");
  EXPECT_FALSE(playback.is_playing());
  page.on_text(R"({"op":"play"})");
  EXPECT_TRUE(playback.is_playing());
  EXPECT_FALSE(page.queue.take());  // nothing was refused
  for (const char* bad : {R"({"op":"seek"})", R"({"op":"seek","at":-1})",
                          R"({"op":"seek","at":"x"})", R"({"op":"speed","times":null})"}) {
    page.on_text(bad);
    const auto told = page.queue.take();
    ASSERT_TRUE(told) << bad;
    EXPECT_NE(told->bytes->find("takes"), std::string::npos) << *told->bytes;
  }
}

TEST_F(PlaybackOfAFile, TimesThatCannotBeAreLeftOutAndCounted) {
  recording::TopicWriter topics;
  ASSERT_EQ(topics.writer().open(path, "test", true), "");
  recording::RobotPose pose;
  pose.set_robot(2);
  pose.mutable_pose()->set_x_m(1);
  topics.write("/pose", pose, kBeginNs);
  topics.write("/pose", pose, UINT64_MAX);
  topics.write("/pose", pose, kBeginNs + 1'000'000);
  ASSERT_TRUE(topics.writer().finish());
  Playback playback(io);
  ASSERT_EQ(playback.open(path), "");
  EXPECT_EQ(playback.problem(), "1 record has an impossible time");
  EXPECT_EQ(playback.length(), milliseconds(1));
}

TEST_F(PlaybackOfAFile, LinksOfASuitesRunHaveTheLossOfTheirReceptions) {
  recording::TopicWriter topics;
  ASSERT_EQ(topics.writer().open(path, "test", true), "");
  recording::RobotPose pose;
  pose.set_robot(5);
  topics.write("/pose", pose, kBeginNs);
  recording::Reception reception;
  reception.set_receiver(5);
  reception.set_sender(6);
  for (std::uint64_t i = 0; i < 400; ++i) {  // one of three is lost
    reception.set_lost_before(i % 2 == 0 ? 1 : 0);
    topics.write("/heard", reception, kBeginNs + i * 1'000'000);
  }
  ASSERT_TRUE(topics.writer().finish());
  Playback playback(io);
  ASSERT_EQ(playback.open(path), "");
  go_to(playback, playback.length());
  const SwarmRobot* const receiver = playback.swarm().find(5);
  ASSERT_NE(receiver, nullptr);
  EXPECT_NEAR(receiver->hears.at(6).loss, 1.0F / 3, 0.04F);
}

}  // namespace
}  // namespace swarmtalk::view
