// `swarmtalk-cli kilobot` against a fake daemon: what it asks for, what it says, how it ends.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>

#include "tests/unit/cli/program.hpp"
#include "tests/unit/client_lib/fake_daemon.hpp"

namespace swarmtalk::test {
namespace {

constexpr std::uint32_t kOperation = 5;

ipc::Envelope started(std::uint32_t frames, std::uint32_t pages = 0) {
  ipc::Envelope envelope;
  ipc::KilobotStarted& body = *envelope.mutable_kilobot_started();
  body.set_operation_id(kOperation);
  body.set_link("table");
  body.set_duration_ms(65'000);
  body.set_frames(frames);
  body.set_pages(pages);
  return envelope;
}

ipc::Envelope progress(std::uint32_t pass, std::uint32_t page) {
  ipc::Envelope envelope;
  ipc::KilobotProgress& body = *envelope.mutable_kilobot_progress();
  body.set_operation_id(kOperation);
  body.set_pass(pass);
  body.set_page(page);
  body.set_left_ms(9'000);
  return envelope;
}

ipc::Envelope ended(ipc::KilobotEnd end, const std::string& text = "", std::uint32_t passes = 0) {
  ipc::Envelope envelope;
  ipc::KilobotEnded& body = *envelope.mutable_kilobot_ended();
  body.set_operation_id(kOperation);
  body.set_end(end);
  body.set_text(text);
  body.set_passes_sent(passes);
  return envelope;
}

class CliKilobot : public ::testing::Test {
 protected:
  CliKilobot() : path_(test_socket_path()), daemon_(path_) {}

  /// What the daemon says to a command, and to its end that a person asks for.
  void say(std::vector<ipc::Envelope> to_the_command) {
    daemon_.says = [to_the_command](const ipc::Envelope& envelope) {
      if (envelope.has_kilobot_command()) return to_the_command;
      if (!envelope.has_kilobot_cancel()) return std::vector<ipc::Envelope>();
      EXPECT_EQ(envelope.kilobot_cancel().operation_id(), kOperation);
      std::vector<ipc::Envelope> stopped(1);
      stopped[0].mutable_done();
      stopped.push_back(ended(ipc::KILOBOT_STOPPED));
      return stopped;
    };
  }
  Strings words(Strings arguments) const {
    arguments.insert(arguments.begin(), {"--socket", path_, "kilobot"});
    return arguments;
  }
  Result run(const Strings& arguments) { return Program(words(arguments)).finish(); }
  /// Ends it with Ctrl-C when the daemon has its command.
  Result interrupt(const Strings& arguments) {
    Program program(words(arguments));
    const auto is_command = [](const ipc::Envelope& each) { return each.has_kilobot_command(); };
    for (int i = 0; i < 60'000 && daemon_.count(is_command) == 0; ++i) ::usleep(1000);
    program.signal(SIGINT);
    return program.finish();
  }
  ipc::KilobotCommand command() {
    for (const ipc::Envelope& each : daemon_.received()) {
      if (each.has_kilobot_command()) return each.kilobot_command();
    }
    ADD_FAILURE() << "no command";
    return {};
  }
  ipc::KilobotCommand last_command() {
    ipc::KilobotCommand last;
    for (const ipc::Envelope& each : daemon_.received()) {
      if (each.has_kilobot_command()) last = each.kilobot_command();
    }
    return last;
  }
  /// Only an interrupt table: of a robot, or of a device that hears no infrared light.
  std::string hex_file(bool is_of_a_robot = true) const {
    const std::string file = std::filesystem::path(path_).parent_path() / "program.hex";
    std::ofstream stream(file);
    for (int entry = 0; entry < 26; ++entry) {
      const bool is_used = entry == 0 || (entry == 23 && is_of_a_robot);
      const unsigned target = is_used ? 0x80u : 0x34u;
      char line[32];
      std::snprintf(line, sizeof line, ":04%04X000C94%02X00%02X\n", entry * 4u, target,
                    (0x100u - ((4u + entry * 4u + 0x0Cu + 0x94u + target) & 0xFF)) & 0xFF);
      stream << line;
    }
    stream << ":00000001FF\n";
    return file;
  }
  static bool has(const std::string& text, const std::string& words) {
    return text.find(words) != std::string::npos;
  }

  const std::string path_;
  FakeDaemon daemon_;
};

TEST_F(CliKilobot, ProgramOfAnotherDeviceIsSentOnlyByForce) {
  const Result refused = run({"program", hex_file(false)});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_TRUE(has(refused.error, "program.hex: it hears no infrared light")) << refused.error;
  EXPECT_TRUE(has(refused.error, "--force"));
  say({started(1, 1), ended(ipc::KILOBOT_SENT, "", 1)});
  const Result forced = run({"program", hex_file(false), "--force"});
  EXPECT_EQ(forced.exit_code, 0) << forced.error;
}

TEST_F(CliKilobot, ProgramTellsItsPassesAndThatItWasSent) {
  say({started(12, 2), progress(0, 0), progress(1, 1), progress(3, 2),
       ended(ipc::KILOBOT_SENT, "", 3)});
  const Result result = run({"program", hex_file(), "--passes", "3"});
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_TRUE(has(result.out, "sent 3 passes; robots that have all pages start the program"));
  EXPECT_FALSE(has(result.out, "done"));
  EXPECT_TRUE(has(result.error, "sending 2 pages, 1:05 in all; keep the robots in the light"));
  EXPECT_TRUE(has(result.error, "pass 3 of 3, page 2 of 2, 0:09 left")) << result.error;
  EXPECT_EQ(command().action(), ipc::KILOBOT_PROGRAM);
  EXPECT_EQ(command().image().size(), 104u);
  EXPECT_EQ(command().image().substr(0, 4), std::string("\x0C\x94\x80\0", 4));
  EXPECT_EQ(command().passes(), 3u);
}

TEST_F(CliKilobot, AProgramThatIsInterruptedSaysWhatRobotsAreLeftWith) {
  say({started(0, 2), progress(1, 1)});
  const Result result = interrupt({"program", hex_file(), "--passes", "0"});
  EXPECT_EQ(result.exit_code, 128 + SIGINT);
  EXPECT_TRUE(has(result.error, "each pass, until Ctrl-C")) << result.error;
  EXPECT_TRUE(has(result.error,
                  "stopped; STOP was sent; robots with a part of the program stay in "
                  "their bootloader"))
      << result.error;
}

TEST_F(CliKilobot, AHeldMessageGoesOnUntilCtrlC) {
  say({started(0)});
  const Result result = interrupt({"pause", "--hold", "0"});
  EXPECT_EQ(result.exit_code, 128 + SIGINT);
  EXPECT_EQ(result.error,
            "swarmtalk-cli: sending until Ctrl-C\nswarmtalk-cli: stopped; STOP was sent\n");
  EXPECT_EQ(command().hold_ms(), 0u);
  EXPECT_TRUE(command().has_hold_ms());
}

TEST_F(CliKilobot, BootloadSaysWhatStartsTheOldProgram) {
  say({started(2), ended(ipc::KILOBOT_SENT)});
  const Result result = run({"bootload"});
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_TRUE(has(result.out, "sent bootload; robots that flash blue wait for a program"));
}

TEST_F(CliKilobot, AControllerThatIsUnpluggedEndsTheCommand) {
  say({started(12, 2), progress(1, 1), ended(ipc::KILOBOT_FAILED, "/dev/ohc is lost")});
  const Result result = run({"program", hex_file()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(has(result.error, "not sent whole: /dev/ohc is lost; robots with a part"))
      << result.error;
}

TEST_F(CliKilobot, StopOfAnotherProgramIsToldAsThat) {
  say({started(12), ended(ipc::KILOBOT_STOPPED, "by another program")});
  const Result result = run({"run"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.error, "swarmtalk-cli: stopped: by another program; STOP was sent\n");
}

TEST_F(CliKilobot, ARefusalIsOneLine) {
  std::vector<ipc::Envelope> refusal(1);
  refusal[0].mutable_failure()->set_text("the overhead controller is busy with 'program'");
  say(refusal);
  const Result result = run({"run"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.error, "swarmtalk-cli: the overhead controller is busy with 'program'\n");
  EXPECT_EQ(result.out, "");
}

/// Both sides of a terminal; the program is at the other.
class Terminal {
 public:
  Terminal() : ours_(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    EXPECT_EQ(::grantpt(ours_), 0);
    EXPECT_EQ(::unlockpt(ours_), 0);
  }
  ~Terminal() { ::close(ours_); }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  const char* name() const { return ::ptsname(ours_); }
  void type(const std::string& keys) const {
    EXPECT_EQ(::write(ours_, keys.data(), keys.size()), static_cast<ssize_t>(keys.size()));
  }

 private:
  const int ours_;
};

TEST_F(CliKilobot, ReadUidAsksForEachBitAndPutsThemTogether) {
  say({started(2), ended(ipc::KILOBOT_SENT)});
  const Terminal terminal;
  Program program(words({"read-uid"}), nullptr, SWARMTALK_CLI, terminal.name());
  terminal.type("maybe\ny\nn\n1\n");
  for (int bit = 3; bit < 16; ++bit) terminal.type("n\n");
  const Result result = program.finish();
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_TRUE(has(result.out, "bit 15: does the robot turn? [y/n] uid 5\n")) << result.out;
  EXPECT_EQ(last_command().action(), ipc::KILOBOT_PAUSE) << "no robot goes on turning";
}

TEST_F(CliKilobot, ReadUidThatIsGivenUpLetsNoRobotTurnOn) {
  constexpr char kCtrlC = 3, kCtrlD = 4;
  for (const char key : {kCtrlC, kCtrlD}) {
    say({started(2), ended(ipc::KILOBOT_SENT)});
    const Terminal terminal;
    Program program(words({"read-uid"}), nullptr, SWARMTALK_CLI, terminal.name());
    EXPECT_TRUE(has(program.read_until('['), "bit 0: does the robot turn?"));
    program.wait_until_it_waits();
    terminal.type(std::string(1, key));
    const Result result = program.finish();
    EXPECT_EQ(result.exit_code, key == kCtrlC ? 128 + SIGINT : 1);
    EXPECT_EQ(result.error, "swarmtalk-cli: the uid is not known; pause was sent\n");
    EXPECT_EQ(last_command().action(), ipc::KILOBOT_PAUSE);
  }
}

TEST_F(CliKilobot, CalibrateWithoutATerminalSendsNothing) {
  const Result result = run({"calibrate"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_TRUE(has(result.error, "draws on a terminal")) << result.error;
  EXPECT_TRUE(has(result.error, "calibrate left, right and straight")) << result.error;
  EXPECT_EQ(std::count(result.error.begin(), result.error.end(), '\n'), 1);
  for (const ipc::Envelope& each : daemon_.received()) EXPECT_FALSE(each.has_kilobot_command());
}

TEST_F(CliKilobot, WarningsComeBeforeTheEnd) {
  ipc::Envelope warned = started(2);
  warned.mutable_kilobot_started()->add_warnings("have one robot in the light");
  say({warned, ended(ipc::KILOBOT_SENT)});
  const Result result = run({"set-uid", "1234"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.error, "swarmtalk-cli: warning: have one robot in the light\n");
  EXPECT_EQ(result.out, "sent set-uid\n");
  EXPECT_EQ(command().uid(), 1234u);
}

}  // namespace
}  // namespace swarmtalk::test
