#include "daemon/operator/metrics_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

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

TEST_F(MetricsFileTest, DoesNotWriteThroughALinkThatSomebodyPutThere) {
  std::ofstream(folder_ + "/precious") << "precious";
  std::filesystem::create_symlink(folder_ + "/precious", folder_ + "/m.new");
  MetricsFile metrics(io_, [this] { return text_; });
  metrics.configure({folder_ + "/m", 15});
  EXPECT_EQ(content(folder_ + "/precious"), "precious");
}

}  // namespace
}  // namespace swarmtalk::daemon
