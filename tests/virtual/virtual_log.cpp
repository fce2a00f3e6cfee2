#include "tests/virtual/virtual_log.hpp"

#include <spdlog/details/null_mutex.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <memory>
#include <string>

#include "daemon/common/logging.hpp"
#include "loop/clock.hpp"
#include "tests/virtual/machine.hpp"

namespace swarmtalk::test {
namespace {

bool is_silent = false;  // NOLINT: of the program

class Sink final : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
 public:
  Sink(Course& course, int& warnings) : course_(course), warnings_(warnings) {
    set_formatter(std::make_unique<spdlog::pattern_formatter>("%Y-%m-%d %H:%M:%S.%e %l: [%n] %v",
                                                              spdlog::pattern_time_type::utc));
  }

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::details::log_msg turned = message;
    turned.time = loop::wall_now();
    spdlog::memory_buf_t line;
    const std::string whose = Machine::present_name() + ' ';
    line.append(whose.data(), whose.data() + whose.size());
    formatter_->format(turned, line);
    course_.add({line.data(), line.size()});
    if (message.level >= spdlog::level::warn) ++warnings_;
    if (!is_silent) std::fwrite(line.data(), 1, line.size(), stderr);
  }
  void flush_() override {}

 private:
  Course& course_;
  int& warnings_;
};

}  // namespace

VirtualLog::VirtualLog(Course& course) : before_(spdlog::default_logger()) {
  spdlog::drop_all();
  const auto sink = std::make_shared<Sink>(course, warnings_);
  for (const char* name : daemon::kSubsystems) {
    spdlog::register_logger(std::make_shared<spdlog::logger>(name, sink));
  }
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("", sink));
}

VirtualLog::~VirtualLog() {
  spdlog::drop_all();
  spdlog::set_default_logger(before_);
}

void silence_virtual_logs() {
  is_silent = true;
}

}  // namespace swarmtalk::test
