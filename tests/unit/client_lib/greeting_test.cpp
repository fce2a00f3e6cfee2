// What is said first, and how long a client waits before it tries again.
#include "client_lib/greeting.hpp"

#include <gtest/gtest.h>

#include "client_lib/backoff.hpp"
#include "ipc/framing.hpp"

namespace swarmtalk::client {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

TEST(Greeting, OfTheClientSaysItsProtocolAndItsName) {
  ipc::Hello hello;
  fill_hello(hello, "test");
  EXPECT_EQ(hello.major(), ipc::kProtocolMajor);
  EXPECT_EQ(hello.minor(), ipc::kProtocolMinor);
  EXPECT_EQ(hello.name(), "test");
}

TEST(Greeting, RefusesNamesThatNoDaemonWouldTake) {
  EXPECT_TRUE(check_name(std::string(1024, 'x')));
  EXPECT_EQ(check_name(std::string(1025, 'x')).code(), StatusCode::kBadArgument);
  EXPECT_EQ(check_name("\xff").code(), StatusCode::kBadArgument);
  EXPECT_EQ(check_name("").text(),
            "the name of this Client is empty; give it the name of your program");
}

TEST(Greeting, OfTheDaemonIsARefusalAVersionOrNeither) {
  ipc::Envelope envelope;
  EXPECT_EQ(check_greeting(envelope, "/s").code(), StatusCode::kProtocol);
  envelope.mutable_hello()->set_major(ipc::kProtocolMajor);
  EXPECT_TRUE(check_greeting(envelope, "/s"));
  envelope.mutable_hello()->set_major(ipc::kProtocolMajor + 1);
  envelope.mutable_hello()->set_name("a daemon");
  const Status other = check_greeting(envelope, "/s");
  EXPECT_EQ(other.code(), StatusCode::kVersionMismatch);
  EXPECT_NE(other.text().find("a daemon at /s speaks local protocol"), std::string::npos);
  envelope.mutable_failure()->set_code(ipc::ERROR_LIMIT);
  EXPECT_EQ(check_greeting(envelope, "/s").code(), StatusCode::kLimit);
}

TEST(Backoff, DoublesUpToItsLongestAndBeginsAgain) {
  Backoff backoff(milliseconds(4), milliseconds(10));
  for (const milliseconds most : {milliseconds(4), milliseconds(8), milliseconds(10)}) {
    const microseconds wait = backoff.next();
    EXPECT_LE(wait, most);
    EXPECT_GE(wait, most / 2);
  }
  backoff.reset();
  EXPECT_LE(backoff.next(), milliseconds(4));
  backoff.be_longest();
  EXPECT_GE(backoff.next(), milliseconds(5));
}

}  // namespace
}  // namespace swarmtalk::client
