// What a program that hears nothing is told.
#include "client_lib/silence.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "client_lib/wakeup.hpp"
#include "tests/support/turned_clock.hpp"

namespace swarmtalk::client {
namespace {

class SilenceAlone : public testing::Test {
 protected:
  static constexpr std::chrono::seconds kPatience{3};
  /// As a program that runs when its timer has gone off.
  void watch_to_the_end() {
    silence_.watch();
    test::pass(kPatience);
    silence_.watch();
  }

  /// The program subscribes by name; without one, by a number.
  std::shared_ptr<SubscriberState> expect(const std::string& name) {
    auto key = std::make_shared<ChannelKey>();
    key->name = name;
    key->label = "channel " + (name.empty() ? "7" : name);
    auto subscriber = std::make_shared<SubscriberState>();
    subscriber->key = key;
    silence_.expect(subscriber);
    return subscriber;
  }
  /// The daemon's answer to what was asked last.
  void answer(ipc::Envelope answer) {
    answer.set_request_id(written_.back().request_id());
    requests_.answer(answer);
  }
  /// These programs publish, or listen.
  void answer_status(const std::vector<std::string>& published,
                     const std::vector<std::string>& listened) {
    ASSERT_TRUE(!written_.empty() && written_.back().has_get_status());
    ipc::Envelope status;
    for (const std::string& name : published) {
      ipc::ChannelStatus& channel = *status.mutable_status()->add_channels();
      channel.set_name(name);
      channel.set_publishers(1);
    }
    for (const std::string& name : listened) {
      status.mutable_status()->add_channels()->set_name(name);
    }
    status.mutable_status();
    answer(status);
  }
  /// These robots are around.
  void answer_around(std::vector<bool> out_of_range) {
    ASSERT_TRUE(!written_.empty() && written_.back().has_get_neighbours());
    ipc::Envelope around;
    around.mutable_neighbours();
    for (const bool is_far : out_of_range) {
      around.mutable_neighbours()->add_neighbours()->set_out_of_range(is_far);
    }
    answer(around);
  }

  std::vector<ipc::Envelope> written_;
  Requests requests_{[this](const ipc::Envelope& envelope) {
    written_.push_back(envelope);
    return true;
  }};
  Wakeup wakeup_;
  std::vector<std::string> told_;
  Silence silence_{requests_, wakeup_, [this](const std::string& text) { told_.push_back(text); },
                   kPatience};
};

TEST_F(SilenceAlone, IsLookedIntoWhenThePatienceIsOver) {
  const auto hello = expect("hello");
  silence_.watch();
  test::pass(kPatience - std::chrono::nanoseconds(1));
  silence_.watch();
  EXPECT_TRUE(written_.empty());
  test::pass(std::chrono::nanoseconds(1));
  silence_.watch();
  EXPECT_EQ(written_.size(), 1u);
}

TEST_F(SilenceAlone, IsToldOnceWhenNobodyIsAround) {
  silence_.watch();
  EXPECT_TRUE(written_.empty()) << "a program that does not listen expects nothing";
  const auto hello = expect("hello");
  watch_to_the_end();
  answer_status({}, {"hello"});
  answer_around({true});
  silence_.watch();
  ASSERT_EQ(told_.size(), 1u);
  EXPECT_NE(told_[0].find("nothing was heard on channel hello: no other robot is around"),
            std::string::npos);
  EXPECT_EQ(written_.size(), 2u);
}

TEST_F(SilenceAlone, IsNotToldWhereARobotIsAround) {
  const auto hello = expect("hello");
  watch_to_the_end();
  answer_status({}, {"hello"});
  answer_around({true, false});
  EXPECT_TRUE(told_.empty());
}

TEST_F(SilenceAlone, IsNotToldWhenAMessageComesMeanwhile) {
  const auto hello = expect("hello");
  watch_to_the_end();
  answer_status({}, {"hello"});
  hello->has_heard = true;
  answer_around({});
  EXPECT_TRUE(told_.empty());
}

TEST_F(SilenceAlone, IsNotToldWhenSomethingElseHasSaidWhy) {
  const auto hello = expect("hello");
  watch_to_the_end();
  silence_.end();
  answer_status({"hallo"}, {"hello"});
  EXPECT_TRUE(told_.empty());
  EXPECT_EQ(written_.size(), 1u);
}

TEST_F(SilenceAlone, NamesTheChannelThatAMisspeltOneMayHaveBeen) {
  const auto heard = expect("alarm");
  heard->has_heard = true;
  const auto number = expect("");
  const auto misspelt = expect("chater");
  watch_to_the_end();
  answer_status({"alarm", "chatter"}, {"chater"});
  ASSERT_EQ(told_.size(), 1u) << "also where others are heard";
  EXPECT_EQ(told_[0],
            "nothing was heard on channel chater: nobody publishes it as far as this robot knows; "
            "did you mean 'chatter'?");
  EXPECT_EQ(written_.size(), 1u) << "who is around does not matter then";
}

TEST_F(SilenceAlone, NamesNoChannelThatIsPublishedOrThatTheProgramHasAnyway) {
  const auto heard = expect("left");
  heard->has_heard = true;
  const auto silent = expect("lift");
  const auto rare = expect("alarm");
  watch_to_the_end();
  answer_status({"left", "alarm", "alarms"}, {"lift"});
  answer_around({});
  EXPECT_TRUE(told_.empty()) << told_[0];
}

TEST_F(SilenceAlone, AsksNobodyWhereAllIsHeard) {
  const auto hello = expect("hello");
  hello->has_heard = true;
  const auto gone = expect("hallo");
  gone->is_closed = true;
  watch_to_the_end();
  EXPECT_TRUE(written_.empty());
}

TEST_F(SilenceAlone, BeginsAnewWithTheNextConnection) {
  const auto hello = expect("hello");
  silence_.watch();
  test::pass(kPatience - std::chrono::nanoseconds(1));
  silence_.forget();
  watch_to_the_end();
  EXPECT_EQ(written_.size(), 1u) << "after the whole patience once more";
}

}  // namespace
}  // namespace swarmtalk::client
