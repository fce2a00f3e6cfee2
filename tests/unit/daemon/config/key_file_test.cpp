#include "daemon/config/key_file.hpp"

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "daemon/config/file_access.hpp"
#include "daemon/host/privileges.hpp"

namespace swarmtalk::daemon {
namespace {

using testing::HasSubstr;

class KeyFile : public ::testing::Test {
 protected:
  KeyFile() {
    std::string name = std::filesystem::temp_directory_path() / "swarmtalk-key-XXXXXX";
    folder_ = mkdtemp(name.data());
  }
  ~KeyFile() override { std::filesystem::remove_all(folder_); }

  std::string path() const { return folder_ / "swarm.key"; }
  void write(const std::string& text, mode_t mode = 0600) {
    std::ofstream(path()) << text;
    chmod(path().c_str(), mode);
  }
  std::string problem() {
    try {
      load_key(path());
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return {};
  }

  /// What it says after "run: ", done as root does it on a robot.
  std::string command() {
    unsetenv("SUDO_USER");
    const std::string text = problem();
    const std::size_t found = text.find("run: ");
    return found == std::string::npos ? "" : text.substr(found + 5);
  }
  void obey(const std::string& words) { EXPECT_EQ(std::system(words.c_str()), 0) << words; }

  std::filesystem::path folder_;
};

const std::string kDigits = "000102030405060708090a0b0c0d0e0f101112131415161718191A1B1C1D1E1F";

TEST_F(KeyFile, HoldsSixtyFourDigits) {
  write("\n " + kDigits + " \n", 0400);
  const auto key = load_key(path());
  for (int i = 0; i < 32; ++i) EXPECT_EQ(key->bytes()[i], i);
}

TEST_F(KeyFile, ThatOthersCanReachIsRefused) {
  for (const mode_t mode : {0640u, 0604u, 0620u, 0602u, 0610u}) {
    write(kDigits, mode);
    EXPECT_THAT(problem(), HasSubstr("others can reach the key; run: ")) << std::oct << mode;
    obey(command());
    EXPECT_EQ(problem(), "") << std::oct << mode;
  }
}

TEST_F(KeyFile, OfAnotherUserIsRefused) {
  if (geteuid() != 0) GTEST_SKIP() << "giving a file away needs root";
  write(kDigits);
  ASSERT_EQ(chown(path().c_str(), 65534, 65534), 0);
  EXPECT_THAT(problem(), HasSubstr("belongs to nobody, who could change the key"));
  for (const mode_t mode : {0600u, 0640u}) {  // one command for owner and mode
    ASSERT_EQ(chown(path().c_str(), 65534, 65534), 0);
    chmod(path().c_str(), mode);
    obey(command());
    EXPECT_EQ(problem(), "");
  }
}

// As a daemon that runs as a user of its own meets it.
TEST_F(KeyFile, OfRootThatAGroupMayReadIsGivenToTheDaemonInOneStep) {
  if (geteuid() != 0) GTEST_SKIP() << "to become another user needs root";
  write(kDigits, 0644);
  chmod(folder_.c_str(), 0755);
  ASSERT_EQ(seteuid(65534), 0);
  const std::string words = command();
  ASSERT_EQ(seteuid(0), 0);
  EXPECT_EQ(words, "sudo chown nobody " + path() + " && sudo chmod 0400 " + path());
}

TEST_F(KeyFile, ThatMayNotBeReadNamesTheCommandForTheFileOrForItsFolder) {
  if (geteuid() != 0) GTEST_SKIP() << "to become another user needs root";
  write(kDigits, 0400);
  chmod(folder_.c_str(), 0755);
  ASSERT_EQ(seteuid(65534), 0);
  const std::string of_file = command();
  ASSERT_EQ(seteuid(0), 0);
  EXPECT_EQ(of_file, "sudo chown nobody " + path() + " && sudo chmod 0400 " + path());
  chmod(folder_.c_str(), 0700);
  ASSERT_EQ(seteuid(65534), 0);
  const std::string of_folder = command();
  ASSERT_EQ(seteuid(0), 0);
  EXPECT_THAT(of_folder, HasSubstr("sudo install -D -o nobody -m 0400 " + path() +
                                   " /etc/swarmtalk/swarm.key, "));
}

TEST_F(KeyFile, ThatIsMissingIsPutThereByTheCommandThatIsNamed) {
  unsetenv("SUDO_USER");
  const std::string text = problem();
  EXPECT_THAT(text, HasSubstr("swarmtalk-cli keygen FILE"));
  const std::size_t begin = text.find("install -D ");
  ASSERT_NE(begin, std::string::npos) << text;
  std::string words = text.substr(begin, text.find(" (") - begin);
  const std::string made = folder_ / "FILE";
  std::ofstream(made) << kDigits;
  ASSERT_NE(words.find("FILE"), std::string::npos) << text;
  obey(words.replace(words.find("FILE"), 4, made));
  EXPECT_EQ(problem(), "");
}

TEST(FileAccess, FolderThatAUnitHidesIsKnownFromItsMounts) {
  const std::string mounts =
      "21 1 8:1 / / ro,relatime shared:1 - ext4 /dev/sda1 rw\n"
      "22 21 0:25 /systemd/inaccessible/dir /home ro,nosuid - tmpfs tmpfs rw,mode=755\n"
      "23 21 0:30 / /run/user rw - tmpfs tmpfs rw\n"
      "24 21 8:1 /tmp/systemd-private-0a-swarmtalkd.service-xy/tmp /tmp rw - ext4 /dev/sda1 rw\n";
  const auto hidden = [&](const std::string& path) {
    std::istringstream stream(mounts);
    return hidden_folder(path, stream);
  };
  EXPECT_EQ(hidden("/home/alice/swarm.key"), "/home");
  EXPECT_EQ(hidden("/tmp/swarm.key"), "/tmp");
  EXPECT_EQ(hidden("/tmpx/swarm.key"), "");
  EXPECT_EQ(hidden("/etc/swarmtalk/swarm.key"), "");
  EXPECT_EQ(hidden("/run/user/1/swarm.key"), "");
}

TEST(FileAccess, ConfigurationThatMayNotBeReadNamesWhatOpensFileAndFolders) {
  if (geteuid() != 0) GTEST_SKIP() << "to become another user needs root";
  std::string folder = std::filesystem::temp_directory_path() / "swarmtalk-access-XXXXXX";
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const std::string file = folder + "/deep/f.toml";
  std::filesystem::create_directory(folder + "/deep");
  std::ofstream(file) << "";
  chmod(file.c_str(), 0600);
  unsetenv("SUDO_USER");
  ASSERT_EQ(seteuid(65534), 0);
  const std::string text = unreadable(file, EACCES, FileKind::kConfiguration);
  ASSERT_EQ(seteuid(0), 0);
  EXPECT_EQ(text, "cannot be read by user nobody: Permission denied; run: sudo chmod a+x " +
                      folder + " " + folder + "/deep && sudo chmod a+r " + file);
  std::filesystem::remove_all(folder);
}

TEST_F(KeyFile, WithoutAKeyIsRefused) {
  for (const std::string& text : {std::string(), kDigits.substr(1), kDigits + "0",
                                  "g" + kDigits.substr(1), std::string(1000, '0')}) {
    write(text);
    EXPECT_THAT(problem(), HasSubstr("64 hexadecimal digits")) << text;
  }
}

TEST_F(KeyFile, ThatAnEditorOfWindowsHasSavedIsTakenOrNamed) {
  write("\xEF\xBB\xBF" + kDigits + "\r\n");
  EXPECT_EQ(load_key(path())->bytes()[31], 31);
  std::string little, big;
  for (const char c : kDigits + "\r\n") {
    little += {c, '\0'};
    big += {'\0', c};
  }
  for (const std::string& text : {little, big, "\xFF\xFE" + little, "\xFE\xFF" + big}) {
    write(text);
    EXPECT_EQ(problem(), path() + " is UTF-16; save it as UTF-8");
  }
}

TEST_F(KeyFile, OfOneByteAgainAndAgainIsRefused) {
  for (const char digit : {'0', 'f'}) {
    write(std::string(64, digit));
    EXPECT_THAT(problem(), HasSubstr("not a secret"));
  }
}

TEST_F(KeyFile, ThatIsNoFileIsRefused) {
  ASSERT_EQ(mkfifo(path().c_str(), 0600), 0);
  EXPECT_THAT(problem(), HasSubstr("is not a file; give the path of one"));
}

TEST(FileAccess, WhatADaemonCannotDoWithoutItsPrivilegesIsKnownAtItsStart) {
  std::string folder = std::filesystem::temp_directory_path() / "swarmtalk-access-XXXXXX";
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  Config config;
  config.links.resize(1);
  config.links[0].key_file = folder + "/swarm.key";
  config.node.pose_socket = folder + "/pose.sock";
  std::vector<std::string> before, after;
  const auto troubles = [&] {
    return later_troubles(config, folder + "/f.toml", folder + "/d.sock");
  };
  std::thread([&] {  // whose capabilities are its own
    drop_privileges();
    before = troubles();
    std::filesystem::permissions(folder, std::filesystem::perms::none);
    after = troubles();
  })
      .join();
  std::filesystem::permissions(folder, std::filesystem::perms::owner_all);
  EXPECT_THAT(before, testing::IsEmpty());
  EXPECT_THAT(after,
              testing::ElementsAre(HasSubstr(folder + "/f.toml"), HasSubstr("install -D -o "),
                                   HasSubstr("/d.sock"), HasSubstr("/pose.sock")));
  config.node.pose_socket.clear();
  EXPECT_THAT(later_troubles(config, folder + "/f.toml", ""), testing::IsEmpty());
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace swarmtalk::daemon
