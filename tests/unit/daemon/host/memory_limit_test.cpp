#include "daemon/host/memory_limit.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace swarmtalk::daemon {
namespace {

class MemoryLimit : public testing::Test {
 protected:
  MemoryLimit() {
    char name[] = "/tmp/swarmtalk-test-XXXXXX";
    root_ = mkdtemp(name);
  }
  ~MemoryLimit() override { std::filesystem::remove_all(root_); }
  void write(const std::string& path, const std::string& text) const {
    std::filesystem::create_directories(std::filesystem::path(root_ + path).parent_path());
    std::ofstream(root_ + path) << text;
  }

  std::string root_;
};

TEST_F(MemoryLimit, IsTheLeastOfTheGroupAndThoseAroundIt) {
  write("/proc/self/cgroup", "0::/system.slice/swarmtalkd.service\n");
  write("/sys/fs/cgroup/system.slice/memory.max", "300\n");
  write("/sys/fs/cgroup/system.slice/swarmtalkd.service/memory.max", "max\n");
  EXPECT_EQ(memory_limit_bytes(root_), 300u);
  write("/sys/fs/cgroup/system.slice/swarmtalkd.service/memory.max", "200\n");
  EXPECT_EQ(memory_limit_bytes(root_), 200u);
}

TEST_F(MemoryLimit, IsFoundInVersionOneToo) {
  write("/proc/self/cgroup", "4:memory:/a\n1:name=systemd:/a\n");
  write("/sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
  EXPECT_FALSE(memory_limit_bytes(root_));
  write("/sys/fs/cgroup/memory/a/memory.limit_in_bytes", "100\n");
  EXPECT_EQ(memory_limit_bytes(root_), 100u);
}

TEST_F(MemoryLimit, IsUnknownWithoutTheSystemsFiles) {
  EXPECT_FALSE(memory_limit_bytes(root_));
}

}  // namespace
}  // namespace swarmtalk::daemon
