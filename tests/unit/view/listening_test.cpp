// Which channels the view listens to, at a daemon that lets one program use so many and no more.
#include "view/listening.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>

#include "tests/unit/client_lib/client_fixture.hpp"

namespace swarmtalk::view {
namespace {

using std::chrono::seconds;

/// The daemon's numbers: of "cN" it is N.
class ListeningTest : public test::ClientTest {
 protected:
  ListeningTest() : daemon_(path) {
    daemon_.says = [this](const ipc::Envelope& asked) { return answer(asked); };
    EXPECT_TRUE(client_.connect());
  }

  std::vector<ipc::Envelope> answer(const ipc::Envelope& asked) {
    if (asked.has_unsubscribe()) ++ended_;
    if (!asked.has_subscribe()) return {};
    ++asked_;
    EXPECT_TRUE(asked.subscribe().looks_on());
    ipc::Envelope envelope;
    if (granted_ - ended_ >= room_) {
      envelope.mutable_failure()->set_code(ipc::ERROR_LIMIT);
      envelope.mutable_failure()->set_text("no more channels");
    } else {
      const ipc::Channel& channel = asked.subscribe().channel();
      envelope.mutable_subscribed()->set_subscription_id(static_cast<std::uint32_t>(++granted_));
      envelope.mutable_subscribed()->set_channel(
          channel.has_name() ? static_cast<std::uint32_t>(std::stoi(channel.name().substr(1)))
                             : channel.number());
    }
    return {envelope};
  }

  /// Subscriptions at the daemon, when all that was said has come there.
  int open() {
    daemon_.received();
    return granted_ - ended_;
  }
  int asked() {
    daemon_.received();
    return asked_;
  }

  static ChannelStatus channel(std::uint16_t number, std::uint32_t publishers,
                               std::uint32_t subscribers = 0, std::uint32_t onlookers = 0) {
    ChannelStatus made;
    made.number = number;
    made.name = "c" + std::to_string(number);
    made.publishers = publishers;
    made.subscribers = subscribers;
    made.onlookers = onlookers;
    return made;
  }
  void note(const std::vector<ChannelStatus>& channels) {
    DaemonStatus status;
    status.channels = channels;
    listening_.note_status(status, own_, reserved_, now_);
  }
  std::vector<std::string> left_out() const {
    std::vector<std::string> names;
    for (const auto& [name, why] : listening_.left_out()) names.push_back(name);
    return names;
  }

  std::atomic<int> room_ = 100, asked_ = 0, granted_ = 0, ended_ = 0;
  test::FakeDaemon daemon_;
  Client client_ = make_client();
  Listening listening_{client_, [](const Message&) {}};
  std::set<std::uint16_t> own_, reserved_;
  Listening::Clock::time_point now_{seconds(1000)};
};

using Names = std::vector<std::string>;

TEST_F(ListeningTest, AChannelHasOneSubscriptionUnderAllItsNames) {
  EXPECT_TRUE(listening_.open("c7"));
  EXPECT_TRUE(listening_.open("7"));
  EXPECT_TRUE(listening_.open("007"));
  EXPECT_EQ(open(), 1);
  for (const char* const name : {"c7", "7", "007"}) EXPECT_EQ(listening_.number_of(name), 7);
  listening_.close("7");
  listening_.close("c7");
  EXPECT_EQ(open(), 1);
  listening_.close("00007");
  EXPECT_EQ(open(), 0);
  EXPECT_EQ(listening_.number_of("c7"), std::nullopt);
}

TEST_F(ListeningTest, ANameOfAChannelThatIsOpenByItsNumberIsAnotherNameOfIt) {
  EXPECT_TRUE(listening_.open("8"));
  EXPECT_TRUE(listening_.open("c8"));
  EXPECT_EQ(open(), 1);
  EXPECT_EQ(listening_.number_of("c8"), 8);
  listening_.close("8");
  EXPECT_EQ(open(), 1);
  listening_.close("c8");
  EXPECT_EQ(open(), 0);
  EXPECT_EQ(listening_.number_of("c8"), std::nullopt) << "the name went with it";
}

TEST_F(ListeningTest, ClosingMoreThanWasOpenedEndsNothing) {
  listening_.close("c1");
  EXPECT_TRUE(listening_.keep("c1"));
  EXPECT_TRUE(listening_.open("c1"));
  for (int i = 0; i < 3; ++i) listening_.close("c1");
  EXPECT_EQ(open(), 1) << "it is kept";
  EXPECT_TRUE(listening_.open("c1"));
  EXPECT_TRUE(listening_.keep("1"));
  EXPECT_EQ(asked(), 1);
}

TEST_F(ListeningTest, IsToChannelsThatProgramsUse) {
  own_ = {1, 2};
  reserved_ = {3};
  note({channel(1, 1), channel(2, 2), channel(3, 1), channel(4, 0, 1), channel(5, 0, 2, 2),
        channel(6, 0, 3, 2), channel(7, 1)});
  EXPECT_EQ(open(), 4) << "2, 4, 6 and 7";
  EXPECT_EQ(listening_.count(), 4u);
  EXPECT_EQ(listening_.number_of("c1"), std::nullopt);
  EXPECT_EQ(left_out(), Names());
  note({channel(2, 2), channel(4, 0, 1, 1), channel(7, 1)});
  EXPECT_EQ(open(), 2) << "2 and 7";
  note({});
  EXPECT_EQ(open(), 0);
}

TEST_F(ListeningTest, AChannelInUseThatIsLookedAtGoesWhenNeitherIsTrueAnyMore) {
  note({channel(1, 1), channel(2, 1)});
  EXPECT_TRUE(listening_.open("c1"));
  EXPECT_TRUE(listening_.open("c2"));
  EXPECT_EQ(open(), 2);
  note({channel(2, 1)});
  EXPECT_EQ(open(), 2);
  listening_.close("c1");
  EXPECT_EQ(open(), 1) << "nobody uses it";
  listening_.close("c2");
  EXPECT_EQ(open(), 1) << "a program uses it";
}

TEST_F(ListeningTest, AWindowTakesThePlaceOfAChannelThatNobodyLooksAt) {
  room_ = 3;
  EXPECT_TRUE(listening_.keep("c1"));
  EXPECT_TRUE(listening_.open("c2"));
  note({channel(3, 1)});
  EXPECT_TRUE(listening_.open("c4"));
  EXPECT_EQ(open(), 3);
  EXPECT_EQ(listening_.number_of("c3"), std::nullopt);
  ASSERT_EQ(left_out(), Names{"c3"});
  EXPECT_NE(listening_.left_out().at("c3").find("channels_per_client"), std::string::npos);
  const Status full = listening_.open("c5");
  EXPECT_EQ(full.code(), StatusCode::kLimit);
  EXPECT_EQ(full.text(), "no more channels");
  EXPECT_EQ(left_out(), (Names{"c3", "c5"}));
  // There is room again: it is not named any more.
  listening_.close("c4");
  EXPECT_TRUE(listening_.open("c5"));
  EXPECT_EQ(left_out(), Names{"c3"});
  for (const char* const name : {"c1", "c2", "c5"}) EXPECT_TRUE(listening_.number_of(name)) << name;
}

TEST_F(ListeningTest, SoManyChannelsAreLookedAtAndNoMore) {
  for (std::size_t i = 0; i < Listening::kMostLookedAt; ++i) {
    EXPECT_TRUE(listening_.open("c" + std::to_string(i)));
  }
  EXPECT_EQ(listening_.open("c24").code(), StatusCode::kLimit);
  EXPECT_TRUE(listening_.open("c0")) << "is open already";
  EXPECT_EQ(open(), 24);
  listening_.close("c1");
  EXPECT_TRUE(listening_.open("c24"));
}

TEST_F(ListeningTest, WhatIsRefusedIsNamedAndTriedAgainAfterAWhile) {
  room_ = 0;
  note({channel(1, 1), channel(2, 1)});
  EXPECT_EQ(left_out(), (Names{"c1", "c2"}));
  EXPECT_EQ(listening_.left_out().at("c1"), "no more channels");
  EXPECT_EQ(asked(), 2);
  now_ += std::chrono::milliseconds(4999);
  note({channel(1, 1), channel(2, 1), channel(3, 1)});
  EXPECT_EQ(asked(), 3) << "the new one alone";
  EXPECT_EQ(left_out(), (Names{"c1", "c2", "c3"}));
  room_ = 1;
  now_ += std::chrono::milliseconds(1);
  note({channel(1, 1), channel(3, 1)});
  EXPECT_EQ(left_out(), Names{"c3"}) << "one is heard, one is gone";
  EXPECT_EQ(asked(), 5);
  note({channel(1, 1), channel(3, 1)});
  EXPECT_EQ(asked(), 5);
}

TEST_F(ListeningTest, SoManyLeftOutAreNamedAndNoMore) {
  room_ = 0;
  std::vector<ChannelStatus> channels;
  for (std::uint16_t i = 0; i < 2 * Listening::kMostLeftOut; ++i) channels.push_back(channel(i, 1));
  note(channels);
  EXPECT_EQ(listening_.left_out().size(), Listening::kMostLeftOut);
}

TEST_F(ListeningTest, WhatADaemonThatCameBackRefusesIsNamedAndTriedAgain) {
  EXPECT_TRUE(listening_.keep("c1"));
  EXPECT_TRUE(listening_.open("c2"));
  note({channel(3, 1)});
  daemon_.kill();
  granted_ = ended_ = room_ = 0;
  daemon_.restart();
  ASSERT_TRUE(run_until(client_, [&] { return reconnects == 1 && asked_ == 6; }));
  // Its refusals have been read when the answer after them has.
  DaemonStatus status;
  ASSERT_TRUE(client_.get_status(status));
  note({channel(3, 1)});
  EXPECT_EQ(left_out(), (Names{"c1", "c2"})) << "3 is tried as a channel in use, not yet again";
  room_ = 3;
  const int before = asked();
  note({});
  EXPECT_EQ(asked(), before) << "not yet";
  now_ += seconds(5);
  note({});
  EXPECT_EQ(open(), 2);
  EXPECT_EQ(left_out(), Names());
}

}  // namespace
}  // namespace swarmtalk::view
