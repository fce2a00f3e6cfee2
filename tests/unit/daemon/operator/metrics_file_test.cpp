#include "daemon/operator/metrics_file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace swarmtalk::daemon {
namespace {

class MetricsFileTest : public testing::Test {
 protected:
  MetricsFileTest() {
    char name[] = "/tmp/swarmtalk-test-XXXXXX";
    folder_ = mkdtemp(name);
  }
  ~MetricsFileTest() override { std::filesystem::remove_all(folder_); }

  static std::string content(const std::string& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }

  std::string folder_, text_ = "one";
  boost::asio::io_context io_;
};

TEST_F(MetricsFileTest, IsThereAtOnceReadableForAllAndGoesWithTheDaemon) {
  const std::string path = folder_ + "/m.prom";
  const mode_t old_mask = umask(0077);
  {
    MetricsFile metrics(io_, [this] { return text_; });
    metrics.configure({path, 15});
    EXPECT_EQ(content(path), "one");
    struct stat made {};
    ASSERT_EQ(stat(path.c_str(), &made), 0);
    EXPECT_EQ(made.st_mode & 0777u, 0644u);
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1);
  }
  umask(old_mask);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(MetricsFileTest, MovesWithTheConfigurationAndEndsWithIt) {
  MetricsFile metrics(io_, [this] { return text_; });
  metrics.configure({folder_ + "/a", 15});
  text_ = "two";
  metrics.configure({folder_ + "/b", 15});
  EXPECT_FALSE(std::filesystem::exists(folder_ + "/a"));
  EXPECT_EQ(content(folder_ + "/b"), "two");
  metrics.configure({});
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(MetricsFileTest, FolderThatComesLaterIsWrittenTo) {
  const std::string path = folder_ + "/later/m";
  MetricsFile metrics(io_, [this] { return text_; });
  metrics.configure({path, 15});
  EXPECT_FALSE(std::filesystem::exists(path));
  std::filesystem::create_directory(folder_ + "/later");
  metrics.configure({path, 15});
  EXPECT_EQ(content(path), "one");
}

TEST_F(MetricsFileTest, WhoReadsWhileItIsWrittenHasAWholeFile) {
  const std::string path = folder_ + "/m";
  MetricsFile metrics(io_, [this] { return text_; });
  metrics.configure({path, 15});
  std::ifstream reader(path);
  text_ = "another";
  metrics.configure({path, 15});
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(reader), {}), "one");
  EXPECT_EQ(content(path), "another");
}

TEST_F(MetricsFileTest, TellsOnceThatItCannotBeWrittenAndOnceThatItIsAgain) {
  int times = 0;
  MetricsFile metrics(io_, [this, &times] {
    ++times;
    return text_;
  });
  const std::string path = folder_ + "/later/m";
  testing::internal::CaptureStdout();  // the default logger's
  metrics.configure({path, 1});
  while (times < 2) io_.run_one();
  std::filesystem::create_directory(folder_ + "/later");
  while (times < 4) io_.run_one();
  const std::string log = testing::internal::GetCapturedStdout();
  for (const std::string& told : {"metrics.file: " + path + " cannot be written",
                                  "metrics.file: " + path + " is written again"}) {
    EXPECT_NE(log.find(told), std::string::npos) << log;
    EXPECT_EQ(log.find(told), log.rfind(told)) << log;
  }
  EXPECT_EQ(content(path), "one");
}

TEST_F(MetricsFileTest, DoesNotWriteThroughALinkThatSomebodyPutThere) {
  std::ofstream(folder_ + "/precious") << "precious";
  std::filesystem::create_symlink(folder_ + "/precious", folder_ + "/m.new");
  MetricsFile metrics(io_, [this] { return text_; });
  metrics.configure({folder_ + "/m", 15});
  EXPECT_EQ(content(folder_ + "/precious"), "precious");
}

TEST_F(MetricsFileTest, DoesNotWaitForAReaderOfAPipeThatSomebodyPutThere) {
  const std::string path = folder_ + "/m";
  ASSERT_EQ(mkfifo((path + ".new").c_str(), 0666), 0);
  MetricsFile metrics(io_, [this] { return text_; });
  testing::internal::CaptureStdout();  // the default logger's
  metrics.configure({path, 15});
  std::string log = testing::internal::GetCapturedStdout();
  EXPECT_NE(log.find("m.new: something else"), std::string::npos) << log;
  const int reader = ::open((path + ".new").c_str(), O_RDONLY | O_NONBLOCK);
  testing::internal::CaptureStdout();
  metrics.configure({path, 15});
  log = testing::internal::GetCapturedStdout();
  EXPECT_NE(log.find("something else than a file"), std::string::npos) << log;
  EXPECT_FALSE(std::filesystem::exists(path));
  ::close(reader);
}

TEST_F(MetricsFileTest, SaysWhatTheSystemSaysWhenThereIsRoomForAPartOnly) {
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  text_.assign(10'000, 'x');
  MetricsFile metrics(io_, [this] { return text_; });
  testing::internal::CaptureStdout();
  const rlimit few{5000, before.rlim_max};  // enough for the log
  setrlimit(RLIMIT_FSIZE, &few);
  metrics.configure({folder_ + "/m", 15});
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, old_handler);
  const std::string log = testing::internal::GetCapturedStdout();
  EXPECT_NE(log.find("File too large"), std::string::npos) << log;
  EXPECT_FALSE(std::filesystem::exists(folder_ + "/m"));
}

}  // namespace
}  // namespace swarmtalk::daemon
