// Keeper of a start: what stays of a lab whose `up` or `run` is killed.
#include "lab/keeper.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <functional>

#include "lab/lab.hpp"
#include "lab/udp_medium.hpp"

namespace swarmtalk::lab {
namespace {

class LabKeeper : public testing::Test {
 protected:
  void SetUp() override {
    setenv("XDG_RUNTIME_DIR", testing::TempDir().c_str(), 1);
    prctl(PR_SET_CHILD_SUBREAPER, 1);
    std::filesystem::create_directories(folder_of(name_));
  }

  void TearDown() override {
    if (daemon_.pid != 0) end_processes({daemon_}, std::chrono::milliseconds(0));
    std::filesystem::remove_all(folder_of(name_));
    forget_word(name_);
  }

  /// A fork that does `work` with a keeper of its lab, says so, and is killed.
  void kill_after(const std::function<void(Keeper&)>& work) {
    int done[2];
    ASSERT_EQ(pipe(done), 0);
    const pid_t pid = fork();
    if (pid == 0) {
      close(done[0]);
      try {
        Keeper keeper;
        keeper.begin(
            name_, [&] { return std::move(*FolderLock::try_take(name_)); }, "it was killed");
        work(keeper);
        [[maybe_unused]] const auto written = write(done[1], "", 1);
        for (;;) pause();
      } catch (...) {
        _exit(1);
      }
    }
    close(done[1]);
    char is_done = 0;
    EXPECT_EQ(read(done[0], &is_done, 1), 1);
    // Nobody holds what the caller may read to its end.
    kill(pid, SIGKILL);
    EXPECT_EQ(read(done[0], &is_done, 1), 0);
    close(done[0]);
    waitpid(pid, nullptr, 0);
  }

  /// A lab of one robot without a namespace, whose daemon is a process that does nothing.
  State lab_of(const ProcessId& owner) {
    const pid_t pid = fork();
    if (pid == 0) {
      for (;;) pause();
    }
    daemon_ = identify(pid);
    State state;
    state.name = name_;
    state.medium = "udp";
    state.keeper = owner;
    state.robots.resize(1);
    state.robots[0].daemon = daemon_;
    return state;
  }

  /// It is this process's child once the one that it looks after has ended.
  void wait_until_keeper_has_ended() const {
    while (waitpid(-1, nullptr, 0) == daemon_.pid) {
    }
  }

  const std::string name_ = "keeper" + std::to_string(getpid());
  ProcessId daemon_;
};

TEST_F(LabKeeper, TakesTheLabDownWhenItsStartIsKilled) {
  State state = lab_of({});
  kill_after([&](Keeper&) {
    state.keeper = identify(getpid());
    save(state);
  });
  wait_until_keeper_has_ended();
  EXPECT_FALSE(std::filesystem::exists(folder_of(name_)));
  EXPECT_FALSE(is_running(daemon_));
  EXPECT_EQ(last_word(name_), "it was killed");
}

TEST_F(LabKeeper, RemovesAFolderInWhichNothingIsWrittenYet) {
  kill_after([](Keeper&) {});
  wait_until_keeper_has_ended();
  EXPECT_FALSE(std::filesystem::exists(folder_of(name_)));
}

TEST_F(LabKeeper, RemovesTheFolderOfAStartThatIsKilledAsItMakesIt) {
  const pid_t pid = fork();
  if (pid == 0) {
    Keeper keeper;
    const auto be_killed = [this]() -> FolderLock {
      auto lock = FolderLock::try_take(name_);
      raise(SIGKILL);
      return std::move(*lock);
    };
    keeper.begin(name_, be_killed, "it was killed");
    _exit(1);
  }
  int status = 0;
  waitpid(pid, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));
  wait_until_keeper_has_ended();
  EXPECT_FALSE(std::filesystem::exists(folder_of(name_)));
}

TEST_F(LabKeeper, LeavesALabThatStaysByItself) {
  const State state = lab_of({});
  kill_after([&](Keeper&) { save(state); });
  wait_until_keeper_has_ended();
  EXPECT_TRUE(std::filesystem::exists(folder_of(name_) / "lab.json"));
  EXPECT_TRUE(is_running(daemon_));
}

TEST_F(LabKeeper, LeavesALabOfTheSameNameThatIsNotItsOwn) {
  const State state = lab_of(identify(getpid()));
  kill_after([&](Keeper&) {
    std::filesystem::remove_all(folder_of(name_));  // as `down` does
    save(state);
  });
  wait_until_keeper_has_ended();
  EXPECT_TRUE(std::filesystem::exists(folder_of(name_) / "lab.json"));
  EXPECT_TRUE(is_running(daemon_));
}

TEST_F(LabKeeper, IsGoneOnceItIsReleased) {
  kill_after([&](Keeper& keeper) {
    keeper.release();
    if (waitpid(-1, nullptr, WNOHANG) != -1) throw std::runtime_error("there is a child");
  });
  EXPECT_TRUE(std::filesystem::exists(folder_of(name_)));
}

TEST_F(LabKeeper, HalfALabIsTakenDownByTheNextThatComes) {
  State state = lab_of({999'999'999, 1});
  save(state);
  EXPECT_TRUE(is_left_behind(state));
  EXPECT_FALSE(is_alive(state));
  take_down_left_behind(name_);
  EXPECT_FALSE(std::filesystem::exists(folder_of(name_)));
  EXPECT_FALSE(is_running(daemon_));
}

TEST_F(LabKeeper, TheFirstWordIsWhyALabEnded) {
  leave_word(name_, "its start was killed");
  leave_word(name_, "the medium ended with 0");
  EXPECT_EQ(last_word(name_), "its start was killed");
  forget_word(name_);
  leave_word(name_, "the medium was killed");
  EXPECT_EQ(last_word(name_), "the medium was killed");
}

TEST(LabSpawn, BeginsNothingThatCouldNotBeWrittenDown) {
  const std::string file = testing::TempDir() + "spawned" + std::to_string(getpid());
  SpawnOptions options;
  pid_t pid = 0;
  options.write_down = [&](const ProcessId& process) {
    pid = process.pid;
    throw std::runtime_error("the disk is full");
  };
  EXPECT_THROW(spawn({"touch", file}, options), std::runtime_error);
  int status = 0;
  EXPECT_EQ(waitpid(pid, &status, 0), pid);
  EXPECT_NE(exit_code(status), 0);
  EXPECT_FALSE(std::filesystem::exists(file));
}

/// As a daemon of a lab whose folder is not where this program looks.
class LabElsewhere : public LabKeeper {
 protected:
  void SetUp() override {
    LabKeeper::SetUp();
    std::filesystem::create_directories(folder_);
    const char* const rest_a_minute = "for i in $(seq 6000); do sleep 0.01; done";
    SpawnOptions options;
    options.write_down = [this](const ProcessId& process) { daemon_ = process; };
    spawn({"sh", "-c", rest_a_minute, "--config", (folder_ / "robot-1.toml").string()}, options);
    for (int i = 0; i < 60'000 && find_elsewhere(name_).folder.empty(); ++i) ::usleep(1000);
  }
  void TearDown() override {
    look_in({});
    std::filesystem::remove_all(folder_);
    LabKeeper::TearDown();
  }
  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / "elsewhere" / "swarmtalk-lab" / name_;
};

TEST_F(LabElsewhere, IsFoundByItsProcesses) {
  EXPECT_TRUE(find_elsewhere("another").folder.empty());
  Elsewhere lab = find_elsewhere(name_);
  EXPECT_EQ(lab.folder, folder_);
  EXPECT_FALSE(lab.is_folder_there) << "nothing of a lab is in it";
  const auto is_daemon = [&](const ProcessId& each) { return each.pid == daemon_.pid; };
  EXPECT_TRUE(std::any_of(lab.processes.begin(), lab.processes.end(), is_daemon));
  State state;
  EXPECT_FALSE(load(name_, state));
  look_in(folder_);
  state.name = name_;
  save(state);
  EXPECT_TRUE(find_elsewhere(name_).is_folder_there);
  EXPECT_TRUE(load(name_, state));
  look_in({});
  EXPECT_FALSE(load(name_, state));
}

TEST_F(LabElsewhere, IsNoneOfAContainerWithFilesOfItsOwn) {
  const pid_t outside = fork();
  if (outside == 0) {
    const bool is_apart = unshare(CLONE_NEWNS) == 0;
    if (!is_apart) _exit(77);
    _exit(find_elsewhere(name_).processes.empty() ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(outside, &status, 0), outside);
  if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "namespaces cannot be made here";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(LabElsewhere, IsBelowTheRuntimeFolderOnlyIfThisUserMayWriteThere) {
  if (geteuid() != 0) GTEST_SKIP() << "needs root to become another user";
  const std::filesystem::path runtime = folder_.parent_path().parent_path();
  for (const uid_t owner : {uid_t{65534}, uid_t{0}}) {
    ASSERT_EQ(chown(runtime.c_str(), owner, 0), 0);
    const pid_t program = fork();
    if (program == 0) {
      if (setenv("XDG_RUNTIME_DIR", runtime.c_str(), 1) != 0 || seteuid(65534) != 0) _exit(2);
      const bool is_below = folder_of(name_) == folder_;
      _exit(is_below == (owner == 65534) ? 0 : 1);
    }
    int status = 0;
    ASSERT_EQ(waitpid(program, &status, 0), program);
    EXPECT_EQ(WEXITSTATUS(status), 0) << "a folder of user " << owner;
  }
}

TEST_F(LabElsewhere, IsNotHeardByOneOfTheSameNameHere) {
  State state;
  state.name = name_;
  const auto here = udp_port_of(state);
  look_in(folder_);
  EXPECT_NE(udp_port_of(state), here);
}

}  // namespace
}  // namespace swarmtalk::lab
