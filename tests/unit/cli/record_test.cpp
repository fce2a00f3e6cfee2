// How programs that run until they are ended end: by Ctrl-C, by kill, by a terminal that goes away.
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>

#include "recording/recording_reader.hpp"
#include "tests/unit/cli/cli_fixture.hpp"

namespace swarmtalk::test {
namespace {

constexpr int kEndings[] = {SIGINT, SIGTERM, SIGHUP};

class CliEndings : public Cli {
 protected:
  /// What was sent before has been read when a question that is asked afterwards is answered.
  void wait_until_all_is_read() {
    const auto is_question = [](const ipc::Envelope& each) { return each.has_get_neighbours(); };
    wait_for(is_question, daemon.count(is_question) + 2);
  }
  /// The same program, started as by `nohup`.
  Strings without_hangup(Strings arguments) const {
    arguments = with_socket(arguments);
    arguments.insert(arguments.begin(), {"-c", "trap '' HUP; exec \"$0\" \"$@\"", SWARMTALK_CLI});
    return arguments;
  }
  const std::string file = std::filesystem::path(path).parent_path() / "r.mcap";
};

TEST_F(CliEndings, ARecordingIsWholeWhateverEndsIt) {
  int subscriptions = 0;
  for (const int number : kEndings) {
    Program program(with_socket({"record", file, "-c", "a", "--replace"}));
    wait_for_subscriptions(subscriptions += 2);  // and that of the log
    for (int i = 0; i < 3; ++i) daemon.deliver("hi");
    wait_until_all_is_read();
    program.signal(number);
    const Result result = program.finish();
    EXPECT_EQ(result.exit_code, 128 + number) << result.error;
    EXPECT_NE(result.out.find("3 messages on 1 channel"), std::string::npos) << result.out;
    recording::RecordingReader reader;
    ASSERT_EQ(reader.open(file), "");
    int heard = 0;
    for (recording::Record each; reader.next(each);) {
      heard += each.kind == recording::Record::Kind::kHeard;
    }
    EXPECT_EQ(heard, 3);
    EXPECT_EQ(reader.problem(), "");
  }
}

TEST_F(CliEndings, AnIgnoredHangupEndsNothing) {
  Program program(without_hangup({"sub", "a"}), nullptr, "/bin/sh");
  wait_for_subscriptions(1);
  program.signal(SIGHUP);
  daemon.deliver("still here");
  EXPECT_NE(program.read_line().find("still here"), std::string::npos);
  program.signal(SIGTERM);
  EXPECT_EQ(program.finish().exit_code, 128 + SIGTERM);
}

}  // namespace
}  // namespace swarmtalk::test
