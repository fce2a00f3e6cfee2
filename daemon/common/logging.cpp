#include "daemon/common/logging.hpp"

#include <google/protobuf/stubs/logging.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "daemon/common/log_limiter.hpp"
#include "daemon/common/patient_sink.hpp"
#include "daemon/common/printable.hpp"
#include "loop/clock.hpp"
#include "text/plain.hpp"

namespace swarmtalk::daemon {

namespace {

// What protobuf says of strings that are not UTF-8. Such a frame is malformed and counted as that.
void log_of_protobuf(google::protobuf::LogLevel, const char*, int, const std::string& text) {
  static LogLimiter limiter;
  if (const auto silent = limiter.pass(loop::now())) {
    log_of("client")->warn("protobuf: {} ({} more since the last line)", printable(text, 200),
                           *silent);
  }
}

/// "<4>": how the journal is told a line's priority (sd-daemon(3)).
class JournalPriority final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&,
              spdlog::memory_buf_t& out) override {
    const char* priority = "<7>";
    if (message.level == spdlog::level::info) priority = "<6>";
    if (message.level == spdlog::level::warn) priority = "<4>";
    if (message.level >= spdlog::level::err) priority = "<3>";
    out.append(priority, priority + 3);
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<JournalPriority>();
  }
};

/// What is logged, plain (text/plain.hpp), whoever's names are in it: one call is one line, and
/// nothing in it steers the terminal that shows it.
class PlainText final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&,
              spdlog::memory_buf_t& out) override {
    const std::string line = text::plain({message.payload.data(), message.payload.size()});
    out.append(line.data(), line.data() + line.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<PlainText>();
  }
};

std::unique_ptr<spdlog::formatter> line_format(bool is_journal) {
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<JournalPriority>('*');
  formatter->add_flag<PlainText>('@');  // in place of spdlog's %v and its %@, which is not used
  // The journal stamps lines itself.
  formatter->set_pattern(is_journal ? "%*%l: [%n] %@" : "%Y-%m-%d %H:%M:%S.%e %^%l%$: [%n] %@");
  return formatter;
}

}  // namespace

void start_logging(const std::string& level, const std::map<std::string, std::string>& levels) {
  const bool is_journal = std::getenv("JOURNAL_STREAM") != nullptr;
  spdlog::sink_ptr sink;
  if (is_journal) {
    sink = std::make_shared<spdlog::sinks::stderr_sink_st>();
  } else {
    sink = std::make_shared<spdlog::sinks::stderr_color_sink_st>();
  }
  sink = std::make_shared<PatientSink>(std::move(sink), STDERR_FILENO);
  spdlog::drop_all();
  for (const char* name : kSubsystems) {
    auto logger = std::make_shared<spdlog::logger>(name, sink);
    logger->set_formatter(line_format(is_journal));
    const auto own = levels.find(name);
    logger->set_level(spdlog::level::from_str(own == levels.end() ? level : own->second));
    logger->flush_on(spdlog::level::trace);
    spdlog::register_logger(logger);
  }
  spdlog::set_default_logger(log_of("daemon"));
  google::protobuf::SetLogHandler(&log_of_protobuf);
}

std::shared_ptr<spdlog::logger> log_of(const char* subsystem) {
  std::shared_ptr<spdlog::logger> logger = spdlog::get(subsystem);
  return logger ? logger : spdlog::default_logger();
}

bool set_log_level(std::string_view subsystem, std::string_view level) {
  const auto is = [](std::string_view wanted) {
    return [wanted](const char* name) { return wanted == name; };
  };
  if (std::none_of(kLogLevels.begin(), kLogLevels.end(), is(level))) return false;
  const bool is_all = subsystem.empty();
  if (!is_all && std::none_of(kSubsystems.begin(), kSubsystems.end(), is(subsystem))) return false;
  for (const char* name : kSubsystems) {
    if (!is_all && subsystem != name) continue;
    log_of(name)->set_level(spdlog::level::from_str(std::string(level)));
  }
  return true;
}

std::vector<std::pair<std::string, std::string>> log_levels() {
  std::vector<std::pair<std::string, std::string>> levels;
  for (const char* name : kSubsystems) {
    const auto level = spdlog::level::to_string_view(log_of(name)->level());
    levels.emplace_back(name, std::string(level.data(), level.size()));
  }
  return levels;
}

}  // namespace swarmtalk::daemon
