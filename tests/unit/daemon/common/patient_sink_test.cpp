#include "daemon/common/patient_sink.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spdlog/logger.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <string>

namespace swarmtalk::daemon {
namespace {

constexpr int kLines = 20'000;  // more than a pipe holds

/// A logger into a pipe that the test may read.
class PatientSinkTest : public testing::Test {
 protected:
  PatientSinkTest() {
    EXPECT_EQ(pipe2(ends_, O_CLOEXEC), 0);
    fcntl(ends_[0], F_SETFL, O_NONBLOCK);
    FILE* const file = fdopen(ends_[1], "w");
    auto inner = std::make_shared<FileSink>(file);
    logger_ =
        std::make_shared<spdlog::logger>("test", std::make_shared<PatientSink>(inner, ends_[1]));
    logger_->set_pattern("%v");
  }
  ~PatientSinkTest() override { ::close(ends_[0]); }

  std::string read_all() const {
    std::string text;
    char bytes[65536];
    for (ssize_t got; (got = ::read(ends_[0], bytes, sizeof bytes)) > 0;) {
      text.append(bytes, static_cast<std::size_t>(got));
    }
    return text;
  }

  class FileSink final
      : public spdlog::sinks::stdout_sink_base<spdlog::details::console_nullmutex> {
   public:
    explicit FileSink(FILE* file) : stdout_sink_base(file), file_(file) {}
    ~FileSink() override { std::fclose(file_); }

   private:
    FILE* file_;
  };

  int ends_[2];
  std::shared_ptr<spdlog::logger> logger_;
};

TEST_F(PatientSinkTest, WaitsForNobodyAndTellsHowManyLinesWereLost) {
  const std::uint64_t before = PatientSink::lost();
  for (int i = 0; i < kLines; ++i) logger_->info("line {}", i);
  const std::string text = read_all();
  const std::uint64_t lost = PatientSink::lost() - before;
  EXPECT_GT(lost, 0u);
  EXPECT_EQ(static_cast<std::uint64_t>(std::count(text.begin(), text.end(), '\n')) + lost,
            std::uint64_t{kLines});
  logger_->info("read again");
  const std::string rest = read_all();
  EXPECT_NE(rest.find(std::to_string(lost) + " log lines were lost"), std::string::npos) << rest;
  EXPECT_NE(rest.find("read again"), std::string::npos);
}

TEST_F(PatientSinkTest, CutsALineThatAPipeMightNotTakeAtOnce) {
  logger_->info("{}", std::string(100'000, 'x'));
  const std::string text = read_all();
  EXPECT_LT(text.size(), PatientSink::kLongestLineBytes + 20);
  EXPECT_NE(text.find("xxx..."), std::string::npos);
}

}  // namespace
}  // namespace swarmtalk::daemon
