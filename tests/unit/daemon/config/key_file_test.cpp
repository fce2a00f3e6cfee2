#include "daemon/config/key_file.hpp"

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>

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
    EXPECT_THAT(problem(), HasSubstr("chmod 600 " + path())) << std::oct << mode;
  }
}

TEST_F(KeyFile, OfAnotherUserIsRefused) {
  if (geteuid() != 0) GTEST_SKIP() << "giving a file away needs root";
  write(kDigits);
  ASSERT_EQ(chown(path().c_str(), 65534, 65534), 0);
  EXPECT_THAT(problem(), HasSubstr("belongs to nobody, who could change the key"));
}

TEST_F(KeyFile, ThatIsMissingNamesTheCommandThatMakesOne) {
  EXPECT_THAT(problem(), HasSubstr("swarmtalk-cli keygen " + path()));
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

}  // namespace
}  // namespace swarmtalk::daemon
