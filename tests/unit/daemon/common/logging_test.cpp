#include "daemon/common/logging.hpp"

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <string>

#include "daemon/session/client_identity.hpp"
#include "ipc/framing.hpp"

namespace swarmtalk::daemon {
namespace {

TEST(Logging, ProtobufDoesNotComplainForEachNameThatIsNotUtf8) {
  const auto before = spdlog::default_logger();
  testing::internal::CaptureStderr();
  start_logging("info");
  ipc::Envelope envelope;
  envelope.mutable_hello()->set_name("\xff");
  for (int i = 0; i < 1000; ++i) envelope.SerializeAsString();
  const std::string text = testing::internal::GetCapturedStderr();
  spdlog::set_default_logger(before);
  EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 2) << text.substr(0, 500);
}

TEST(Logging, NoNameEndsItsLineOrSteersTheTerminal) {
  const auto before = spdlog::default_logger();
  testing::internal::CaptureStderr();
  start_logging("info");
  log_of("client")->info("client {} is here", "x\n\u009b31m\u202Ey\xff");
  const std::string text = testing::internal::GetCapturedStderr();
  spdlog::set_default_logger(before);
  EXPECT_NE(text.find("client x\\n\\u009b31m\\u202ey\\xff is here\n"), std::string::npos) << text;
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
}

TEST(Logging, ANameCannotFakeTheRestOfItsLine) {
  ClientIdentity client;
  client.name = "x' (pid 1, uid 0) closed: gone";
  client.pid = 7;
  client.uid = 0;
  EXPECT_EQ(client.who(), "client 'x\\' (pid 1, uid 0) closed: gone' (pid 7, uid 0)");
}

}  // namespace
}  // namespace swarmtalk::daemon
