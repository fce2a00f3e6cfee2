// What a program that hears nothing is told.
#include "client_lib/silence.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/unit/client_lib/client_fixture.hpp"

namespace swarmtalk::client {
namespace {

class SilenceAlone : public testing::Test {
 protected:
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
                   std::chrono::milliseconds(0)};
};

TEST_F(SilenceAlone, IsToldOnceWhenNobodyIsAround) {
  silence_.watch();
  EXPECT_TRUE(written_.empty()) << "a program that does not listen expects nothing";
  const auto hello = expect("hello");
  silence_.watch();
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
  silence_.watch();
  answer_status({}, {"hello"});
  answer_around({true, false});
  EXPECT_TRUE(told_.empty());
}

TEST_F(SilenceAlone, IsNotToldWhenAMessageComesMeanwhile) {
  const auto hello = expect("hello");
  silence_.watch();
  answer_status({}, {"hello"});
  hello->has_heard = true;
  answer_around({});
  EXPECT_TRUE(told_.empty());
}

TEST_F(SilenceAlone, IsNotToldWhenSomethingElseHasSaidWhy) {
  const auto hello = expect("hello");
  silence_.watch();
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
  silence_.watch();
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
  silence_.watch();
  answer_status({"left", "alarm", "alarms"}, {"lift"});
  answer_around({});
  EXPECT_TRUE(told_.empty()) << told_[0];
}

TEST_F(SilenceAlone, AsksNobodyWhereAllIsHeard) {
  const auto hello = expect("hello");
  hello->has_heard = true;
  const auto gone = expect("hallo");
  gone->is_closed = true;
  silence_.watch();
  EXPECT_TRUE(written_.empty());
}

TEST_F(SilenceAlone, BeginsAnewWithTheNextConnection) {
  Silence patient(
      requests_, wakeup_, [](const std::string&) {}, std::chrono::hours(1));
  patient.expect(expect("hello"));
  patient.watch();
  patient.forget();
  patient.watch();
  EXPECT_TRUE(written_.empty());
}

class Listener : public test::ClientTest {};

TEST_F(Listener, OfAWildcardIsToldThatThereAreNone) {
  test::FakeDaemon daemon(path);
  Client plain("plain", options());
  ASSERT_TRUE(plain.connect());
  testing::internal::CaptureStderr();
  const auto all = plain.subscribe("#", [](const Message&) {});
  const auto more = plain.subscribe("robots/+", [](const Message&) {});
  const auto own = plain.subscribe("robots", [](const Message&) {});
  const std::string told = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(told.begin(), told.end(), '\n'), 1) << told;
  EXPECT_NE(told.find("'#' is the name of one channel: there are no wildcards"), std::string::npos)
      << told;
  static_cast<void>(plain.process());
}

TEST_F(Listener, OfDigitsInQuotesIsToldThatTheyAreAName) {
  test::FakeDaemon daemon(path);
  Client plain("plain", options());
  ASSERT_TRUE(plain.connect());
  testing::internal::CaptureStderr();
  const auto name = plain.advertise("5");
  const auto number = plain.channel(5).publisher();
  const std::string told = testing::internal::GetCapturedStderr();
  EXPECT_EQ(
      told,
      "swarmtalk: channel \"5\" is a name here, and not channel number 5; for the number leave "
      "out the quotes\n");
}

}  // namespace
}  // namespace swarmtalk::client
