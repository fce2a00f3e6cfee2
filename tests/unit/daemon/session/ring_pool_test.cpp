#include "daemon/session/ring_pool.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

namespace swarmtalk::daemon {
namespace {

class RingPoolTest : public testing::Test {
 protected:
  static ClientIdentity somebody(std::uint32_t uid, pid_t pid = getpid()) {
    return {"test", static_cast<std::uint32_t>(pid), uid};
  }
  static pid_t ended_process() {
    const pid_t pid = fork();
    if (pid == 0) _exit(0);
    EXPECT_EQ(waitpid(pid, nullptr, 0), pid);
    return pid;
  }

  LimitsConfig limits_;
  RingPool pool_{limits_};
};

TEST_F(RingPoolTest, MemoryOfAClientThatHasLeftIsUsedAgain) {
  for (int i = 0; i < 1000; ++i) {
    auto memory = pool_.take(somebody(1));
    ASSERT_TRUE(memory);
    EXPECT_EQ(memory->header().written, 0u);
    memory->header().written = 7;
    pool_.give_back(std::move(*memory), somebody(1), true);
  }
  EXPECT_EQ(pool_.size(), 1u);
}

TEST_F(RingPoolTest, AProcessThatLivesMayStillWriteIntoItsMemory) {
  limits_.clients_per_user = 3;
  for (int i = 0; i < 3; ++i) pool_.give_back(*pool_.take(somebody(1)), somebody(1), false);
  EXPECT_FALSE(pool_.take(somebody(1))) << "it is served through its socket";
  EXPECT_TRUE(pool_.take(somebody(2)));
}

TEST_F(RingPoolTest, MemoryOfAProcessThatHasEndedIsUsedAgain) {
  const pid_t ended = ended_process();
  for (int i = 0; i < 1000; ++i) {
    auto memory = pool_.take(somebody(1, ended));
    ASSERT_TRUE(memory);
    pool_.give_back(std::move(*memory), somebody(1, ended), false);
  }
  EXPECT_EQ(pool_.size(), 1u);
}

TEST_F(RingPoolTest, NobodyGetsAnotherUsersMemory) {
  pool_.give_back(*pool_.take(somebody(1)), somebody(1), true);
  EXPECT_TRUE(pool_.take(somebody(2)));
  EXPECT_EQ(pool_.size(), 2u);
}

TEST_F(RingPoolTest, AllUsersTogetherHaveSoMany) {
  limits_.clients = 4;
  limits_.clients_per_user = 1;
  int made = 0;
  for (std::uint32_t uid = 1; uid <= 20; ++uid) made += pool_.take(somebody(uid)) ? 1 : 0;
  EXPECT_EQ(made, 8);
}

TEST_F(RingPoolTest, AnotherSizeAfterAReloadReplacesWhatIsFree) {
  pool_.give_back(*pool_.take(somebody(1)), somebody(1), true);
  limits_.ring_bytes = 4096;
  const auto memory = pool_.take(somebody(1));
  ASSERT_TRUE(memory);
  EXPECT_EQ(memory->capacity(), 4096u);
  EXPECT_EQ(pool_.size(), 1u);
}

TEST_F(RingPoolTest, WhoTakesPagesAwayGetsNoRingAnyMore) {
  pool_.bar(somebody(1));
  EXPECT_FALSE(pool_.take(somebody(1)));
  EXPECT_TRUE(pool_.take(somebody(2)));
}

}  // namespace
}  // namespace swarmtalk::daemon
