#include "daemon/config/config_changes.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <regex>

#include "daemon/config/config_parser.hpp"

namespace swarmtalk::daemon {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr const char* kOneLink = "[links.w]\ntype = \"udp\"\n";

KeyLines lines(const std::string& text) {
  return parse_config(kOneLink + text, "f.toml").lines;
}

TEST(ConfigChanges, OfEqualFilesAreNone) {
  const ConfigChanges changes = compare(lines("rate_hz = 3\n"), lines("# other\nrate_hz=3\n"));
  EXPECT_THAT(changes.applied, IsEmpty());
  EXPECT_THAT(changes.need_restart, IsEmpty());
}

TEST(ConfigChanges, NameKeysThatDifferComeOrGo) {
  const ConfigChanges changes =
      compare(lines("rate_hz = 3\nport = 4\n[channels]\na = 1\nb = 2\n"),
              lines("rate_hz = 4\ninterface = \"lo\"\n[channels]\na = 1\nc = 3\n"));
  EXPECT_THAT(changes.applied, ElementsAre("channels.b", "channels.c", "links.w.rate_hz"));
  EXPECT_THAT(changes.need_restart, ElementsAre("links.w.interface", "links.w.port"));
}

TEST(ConfigChanges, SeeIntoArrays) {
  const ConfigChanges changes =
      compare(lines("[node]\npose = [1, 2, 3]\n"), lines("[node]\npose = [1, 2, 4]\n"));
  EXPECT_THAT(changes.applied, ElementsAre("node.pose"));
}

TEST(ConfigChanges, LeaveOutWhatTheCommandLineDecides) {
  KeyLines after = lines("[node]\nid = 4\n");
  after.set_option("node.id", "--node-id");
  EXPECT_THAT(compare(lines("[node]\nid = 3\n"), after).applied, IsEmpty());
}

TEST(ConfigChanges, OfALinkThatIsNewOrGoneNeedARestart) {
  const std::string two = "[links.x]\ntype = \"udp\"\nport = 7\nrate_hz = 1\n";
  for (const ConfigChanges& changes :
       {compare(lines(""), lines(two)), compare(lines(two), lines(""))}) {
    EXPECT_THAT(changes.applied, IsEmpty());
    EXPECT_THAT(changes.need_restart,
                ElementsAre("links.x.port", "links.x.rate_hz", "links.x.type"));
  }
  const ConfigChanges changes = compare(lines(""), lines(two));
}

// Every table of the manual has a column "reload", and it says what the code does.
TEST(ConfigChanges, AreAsTheManualSays) {
  std::ifstream file(SWARMTALK_DOCS "/configuration.md");
  const std::regex section_line(R"(## `\[+([a-z]+).*)");
  const std::regex key_line(R"(\| `([a-z0-9_]+)`.*\| (\w+) \|)");
  std::string section;
  bool is_key_table = false;
  int keys = 0;
  for (std::string line; std::getline(file, line);) {
    std::smatch match;
    if (line.starts_with("## ")) {
      section = std::regex_match(line, match, section_line) ? match.str(1) : "";
    } else if (line.starts_with("| key |")) {
      is_key_table = true;
      EXPECT_TRUE(line.ends_with("| reload |")) << section;
    } else if (!line.starts_with("|")) {
      is_key_table = false;
    } else if (is_key_table && line.starts_with("| `")) {
      ASSERT_TRUE(std::regex_match(line, match, key_line)) << "no column reload: " << line;
      const std::string key = section + (section == "links" ? ".w." : ".") + match.str(1);
      EXPECT_EQ(match.str(2), applies_on_reload(key) ? "yes" : "restart") << key;
      ++keys;
    }
  }
  EXPECT_GT(keys, 30);
}

}  // namespace
}  // namespace swarmtalk::daemon
