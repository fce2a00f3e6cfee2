#include "daemon/common/logging.hpp"

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <string>

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

}  // namespace
}  // namespace swarmtalk::daemon
