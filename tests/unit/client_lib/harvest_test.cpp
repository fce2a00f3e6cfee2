// Harvest and Client::log() against a daemon that says what it is told.
#include <swarmtalk/client/harvest.hpp>

#include "report/harvest_text.hpp"
#include "tests/unit/client_lib/client_fixture.hpp"

namespace swarmtalk::test {
namespace {

class HarvestTest : public ClientTest {
 protected:
  HarvestTest() : daemon(path), client(make_client()) { EXPECT_TRUE(client.connect()); }

  std::vector<ipc::Publish> published() {
    std::vector<ipc::Publish> found;
    for (const ipc::Envelope& each : daemon.received()) {
      if (each.has_publish()) found.push_back(each.publish());
    }
    return found;
  }

  FakeDaemon daemon;
  Client client;
};

TEST_F(HarvestTest, ValuesOfTheKeysThatAreAskedForAreTheAnswer) {
  Harvest harvest(client);
  ASSERT_TRUE(harvest.status());
  ASSERT_TRUE(harvest.set("battery", "4.1"));
  ASSERT_TRUE(harvest.set("battery", "3.9"));
  ASSERT_TRUE(harvest.set("state", "idle"));
  daemon.deliver(report::encode({7, 3, "bat"}));
  ASSERT_TRUE(run_until(client, [&] { return daemon.count(is_publish) == 1; }));
  std::string answer = report::begin_answer(7);
  report::append_value(answer, "battery", "3.9");
  EXPECT_EQ(published()[0].payload(), answer);
  EXPECT_EQ(published()[0].ttl(), 3u);
}

TEST_F(HarvestTest, NothingIsSaidWhereThereIsNoSuchValue) {
  Harvest harvest(client);
  ASSERT_TRUE(harvest.set("state", "idle"));
  daemon.deliver(report::encode({7, 3, "bat"}));
  daemon.deliver("no question");
  daemon.deliver(report::encode({8, 3, "state"}));
  ASSERT_TRUE(run_until(client, [&] { return daemon.count(is_publish) > 0; }));
  EXPECT_EQ(daemon.count(is_publish), 1);
  harvest.remove("state");
  daemon.deliver(report::encode({9, 3, ""}));
  client.run_for(std::chrono::milliseconds(50));
  EXPECT_EQ(daemon.count(is_publish), 1);
}

TEST_F(HarvestTest, ManyValuesGoIntoSeveralMessages) {
  Harvest harvest(client);
  for (const char* key : {"a", "b", "c"}) ASSERT_TRUE(harvest.set(key, std::string(40, 'x')));
  daemon.deliver(report::encode({7, 0, ""}));  // messages have at most 100 bytes here
  ASSERT_TRUE(run_until(client, [&] { return daemon.count(is_publish) == 2; }));
  std::string keys;
  for (const ipc::Publish& each : published()) {
    EXPECT_TRUE(report::decode_answer(
        each.payload(), 7, [&](std::string_view key, std::string_view) { keys += key; }));
  }
  EXPECT_EQ(keys, "abc");
}

TEST_F(HarvestTest, AnswersToTheLastQuestionAreFound) {
  Harvest harvest(client);
  std::vector<std::string> found;
  const auto note = [&](const HarvestedValue& value) { found.push_back(value.key + value.value); };
  ASSERT_TRUE(harvest.ask("x", note));
  ASSERT_TRUE(harvest.ask("battery", note, 2));
  ASSERT_TRUE(run_until(client, [&] { return daemon.count(is_publish) == 2; }));
  EXPECT_EQ(published()[1].ttl(), 2u);
  const auto asked = published();
  for (const ipc::Publish& each : asked) {
    const auto question = report::decode_question(each.payload());
    ASSERT_TRUE(question);
    std::string answer = report::begin_answer(question->number);
    report::append_value(answer, std::string(question->prefix), "=3.9");
    daemon.deliver(answer);
  }
  ASSERT_TRUE(run_until(client, [&] { return !found.empty(); }));
  client.run_for(std::chrono::milliseconds(50));
  EXPECT_EQ(found, (std::vector<std::string>{"battery=3.9"}));
}

TEST_F(HarvestTest, WhatIsTooLongIsRefusedByName) {
  Harvest harvest(client);
  EXPECT_EQ(harvest.set("", "x").code(), StatusCode::kBadArgument);
  EXPECT_EQ(harvest.set(std::string(65, 'k'), "x").code(), StatusCode::kBadArgument);
  EXPECT_EQ(harvest.set("k", std::string(513, 'x')).code(), StatusCode::kBadArgument);
  for (std::size_t i = 0; i < Harvest::kMaxValues; ++i) {
    ASSERT_TRUE(harvest.set("k" + std::to_string(i), ""));
  }
  EXPECT_EQ(harvest.set("one more", "x").code(), StatusCode::kBadArgument);
  EXPECT_TRUE(harvest.set("k0", "another value"));
}

TEST_F(HarvestTest, WhereItIsOffTheStatusSaysSo) {
  daemon.refuse_channels.set_code(ipc::ERROR_BAD_CHANNEL);
  daemon.refuse_channels.set_text("channel 'harvest' is reserved, and off");
  Harvest harvest(client);
  EXPECT_EQ(harvest.status().code(), StatusCode::kBadChannel);
  EXPECT_EQ(harvest.ask("", [](const HarvestedValue&) {}).code(), StatusCode::kBadChannel);
  EXPECT_EQ(client.log("x").code(), StatusCode::kBadChannel);
}

TEST_F(HarvestTest, LogLinesLeaveOnOnePublisherOfChannelDebug) {
  ASSERT_TRUE(client.log("one"));
  ASSERT_TRUE(client.log("two"));
  ASSERT_TRUE(run_until(client, [&] { return daemon.count(is_publish) == 2; }));
  EXPECT_EQ(published()[1].payload(), "two");
  std::vector<ipc::Advertise> advertised;
  for (const ipc::Envelope& each : daemon.received()) {
    if (each.has_advertise()) advertised.push_back(each.advertise());
  }
  ASSERT_EQ(advertised.size(), 1u);
  EXPECT_EQ(advertised[0].channel().name(), "debug");
  EXPECT_EQ(advertised[0].ttl(), 4u);
  EXPECT_TRUE(advertised[0].drop_oldest());
}

}  // namespace
}  // namespace swarmtalk::test
