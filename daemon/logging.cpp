#include "daemon/logging.hpp"

#include <google/protobuf/stubs/logging.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdlib>
#include <memory>

#include "daemon/log_limiter.hpp"
#include "daemon/printable.hpp"

namespace swarmtalk::daemon {

namespace {

// What protobuf says of strings that are not UTF-8. Such a frame is malformed and counted as that.
void log_of_protobuf(google::protobuf::LogLevel, const char*, int, const std::string& text) {
  static LogLimiter limiter;
  if (const auto silent = limiter.pass(std::chrono::steady_clock::now())) {
    spdlog::warn("protobuf: {} ({} more since the last line)", printable(text, 200), *silent);
  }
}

}  // namespace

void start_logging(const std::string& level) {
  const bool is_journal = std::getenv("JOURNAL_STREAM") != nullptr;
  spdlog::sink_ptr sink;
  if (is_journal) {
    sink = std::make_shared<spdlog::sinks::stderr_sink_st>();
  } else {
    sink = std::make_shared<spdlog::sinks::stderr_color_sink_st>();
  }
  auto logger = std::make_shared<spdlog::logger>("swarmtalkd", sink);
  // The journal stamps lines itself.
  logger->set_pattern(is_journal ? "%l: %v" : "%Y-%m-%d %H:%M:%S.%e %^%l%$: %v");
  logger->set_level(spdlog::level::from_str(level));
  logger->flush_on(spdlog::level::trace);
  spdlog::set_default_logger(logger);
  google::protobuf::SetLogHandler(&log_of_protobuf);
}

}  // namespace swarmtalk::daemon
