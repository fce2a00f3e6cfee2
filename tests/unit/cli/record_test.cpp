// How programs that run until they are ended end: by Ctrl-C, by kill, by a terminal that goes away.
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <initializer_list>

#include "recording/recorder.hpp"
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
  void capture_begins() {
    daemon.says = [](const ipc::Envelope& request) {
      std::vector<ipc::Envelope> envelopes(request.has_capture() ? 1 : 0);
      if (request.has_capture()) envelopes[0].mutable_done();
      return envelopes;
    };
  }
  /// A hundred frames a second, for half a minute at most.
  void capture_until(const std::function<bool()>& is_enough) {
    for (int i = 0; i < 3000 && !is_enough(); ++i) {
      daemon.send_raw(captured());
      ::usleep(10'000);
    }
  }
  static std::string captured() {
    ipc::Envelope envelope;
    envelope.mutable_captured()->set_frame(std::string(60, 'f'));
    std::string bytes;
    ipc::append_frame(envelope, bytes);
    return bytes;
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

TEST_F(CliEndings, PlayTellsWhatIsOutOfOrderAndWhereItWillBeSilent) {
  using std::chrono::seconds;
  constexpr seconds kYears50 = std::chrono::hours(24 * 365 * 50);
  const auto record = [&](std::initializer_list<seconds> times) {
    std::filesystem::remove(file);
    recording::Recorder recorder;
    EXPECT_EQ(recorder.open(file, "test", true), "");
    const auto begin = recording::Recorder::Clock::now();
    for (const seconds time : times) {
      Message message;
      message.channel = 7;
      message.payload = "x";
      recorder.heard("7", message, begin + time);
    }
    EXPECT_TRUE(recorder.finish());
  };
  record({seconds(0), seconds(2), seconds(-1), seconds(1)});
  const Result played = run({"play", file, "--rate", "100"});
  EXPECT_EQ(played.exit_code, 0) << played.error;
  EXPECT_EQ(daemon.count(is_publish), 4);
  EXPECT_NE(played.error.find("1 message is not in the order of time"), std::string::npos);
  record({seconds(0), kYears50});
  Program program(with_socket({"play", file}));
  const std::string line = program.read_error_line();
  const std::size_t number = line.find_first_of("0123456789");
  ASSERT_NE(number, std::string::npos) << line;
  const long long left_s = std::stoll(line.substr(number));
  EXPECT_LT(left_s, kYears50.count()) << line;
  EXPECT_GT(left_s, kYears50.count() - 60) << line;  // of a busy machine
  program.signal(SIGHUP);
  EXPECT_EQ(program.finish().exit_code, 128 + SIGHUP);
  EXPECT_EQ(daemon.count(is_publish), 5);
}

TEST_F(CliEndings, ACaptureIsInItsFileWhileFramesGoOnComing) {
  capture_begins();
  const std::string capture = file + ".pcap";
  Program program(with_socket({"capture", capture}));
  wait_for([](const ipc::Envelope& each) { return each.has_capture(); }, 1);
  constexpr std::uintmax_t kHeaderBytes = 24, kBufferBytes = 4096;
  std::uintmax_t size = kHeaderBytes;
  capture_until([&] {
    std::error_code none_yet;
    size = std::filesystem::file_size(capture, none_yet);
    if (none_yet) size = kHeaderBytes;
    return (size - kHeaderBytes) % kBufferBytes != 0;
  });
  program.signal(SIGKILL);
  const Result result = program.finish();
  EXPECT_EQ(result.exit_code, 1000 + SIGKILL) << result.error;
  EXPECT_NE((size - kHeaderBytes) % kBufferBytes, 0u) << "it waits for its buffer to be full";
}

TEST_F(CliEndings, ACaptureThatDoesNotFitIsAFailure) {
  capture_begins();
  const std::string capture = file + ".pcap";
  Strings words = with_socket({"capture", capture, "-C", "200"});
  words.insert(words.begin(), {"-c", "ulimit -f 4; exec \"$0\" \"$@\"", SWARMTALK_CLI});
  Program program(words, nullptr, "/bin/sh");
  wait_for([](const ipc::Envelope& each) { return each.has_capture(); }, 1);
  for (int i = 0; i < 200; ++i) daemon.send_raw(captured());
  const Result result = program.finish();
  EXPECT_EQ(result.exit_code, 1) << result.out;
  EXPECT_NE(result.error.find("cannot write " + capture + ": File too large"), std::string::npos)
      << result.error;
  Strings copying{
      "-c",   "ulimit -f 1; exec \"$0\" \"$@\"", SWARMTALK_CLI, "capture", file + ".copy", "--from",
      capture};
  const Result copied = Program(copying, nullptr, "/bin/sh").finish();
  EXPECT_EQ(copied.exit_code, 1) << copied.out;
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

TEST_F(CliEndings, AJobOfAScriptSaysWhatEndsIt) {
  for (const char* verb : {"record", "capture"}) {
    capture_begins();
    Strings words = with_socket({verb, file + "." + verb, "-W", "60"});
    words.insert(words.begin(), {"-c", "\"$0\" \"$@\" & wait $!; exit $?", SWARMTALK_CLI});
    Program script(words, nullptr, "/bin/sh");
    std::string told = script.read_error_line();
    while (!told.empty() && told.find("kill -INT") == std::string::npos) {
      told = script.read_error_line();
    }
    const auto remedy = told.rfind("kill ");
    ASSERT_NE(remedy, std::string::npos) << verb;
    EXPECT_EQ(std::system(told.substr(remedy).c_str()), 0) << told;
    EXPECT_EQ(script.finish().exit_code, 128 + SIGTERM) << verb;
  }
}

}  // namespace
}  // namespace swarmtalk::test
