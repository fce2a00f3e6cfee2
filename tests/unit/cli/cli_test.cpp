// The program itself against a fake daemon: output, exit codes, signals, pipes.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/unit/cli/cli_fixture.hpp"

namespace swarmtalk::test {
namespace {

using nlohmann::json;

TEST_F(Cli, PubSendsAndWaitsUntilItHasLeft) {
  const Result result = run({"pub", "hello", "good morning", "--ttl", "2"});
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_EQ(result.out + result.error, "");
  EXPECT_EQ(last_publish().payload(), "good morning");
  EXPECT_EQ(daemon.received()[1].advertise().ttl(), 2u);
}

TEST_F(Cli, PubTakesHexAndStandardInputByteForByte) {
  EXPECT_EQ(run({"pub", "7", "--hex", "00:ff"}).exit_code, 0);
  EXPECT_EQ(last_publish().payload(), std::string("\0\xff", 2));
  EXPECT_EQ(run({"pub", "7", "-"}, std::string("a\0\n", 3)).exit_code, 0);
  EXPECT_EQ(last_publish().payload(), std::string("a\0\n", 3));
  EXPECT_EQ(run({"pub", "7", ""}).exit_code, 0);
  EXPECT_EQ(last_publish().payload(), "");
}

TEST_F(Cli, DigitsAreANumberAndAnythingElseIsAName) {
  run({"sub", "7", "7up", "-W", "0.02"});
  const auto envelopes = daemon.received();
  EXPECT_EQ(envelopes[1].subscribe().channel().number(), 7u);
  EXPECT_EQ(envelopes[2].subscribe().channel().name(), "7up");
}

TEST_F(Cli, PubRepeats) {
  EXPECT_EQ(run({"pub", "c", "x", "--repeat", "5", "--rate", "200"}).exit_code, 0);
  EXPECT_EQ(daemon.count([](const auto& e) { return e.has_publish(); }), 5);
}

TEST_F(Cli, PubTellsTooLongOnceWithTheLimit) {
  const Result result = run({"pub", "c", std::string(101, 'x')});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.error,
            "swarmtalk-cli: the message has 101 bytes; channel c carries at most 100\n");
}

TEST_F(Cli, PubGivesUpAfterItsTimeout) {
  daemon.answers_publish = false;
  const Result result = run({"pub", "c", "x", "-W", "0.05"});
  EXPECT_EQ(result.exit_code, 124);
  EXPECT_EQ(lines(result.error), 1);
}

TEST_F(Cli, PubTellsWhyAChannelIsRefused) {
  daemon.refuse_channels.set_code(ipc::ERROR_BAD_CHANNEL);
  daemon.refuse_channels.set_text("channel 16 is above 15");
  const Result result = run({"pub", "16", "x"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.error, "swarmtalk-cli: channel 16 is above 15\n");
}

TEST_F(Cli, SubPrintsJsonLinesAndEndsAtTheCount) {
  Program program(with_socket({"sub", "a", "b", "--json", "-C", "2"}));
  wait_for_subscriptions(2);
  ipc::Deliver deliver;
  deliver.set_payload("hi");
  deliver.set_sender(3);
  deliver.set_distance_m(0.5F);
  daemon.deliver(deliver);  // once to each of the two subscriptions
  const Result result = program.finish();
  EXPECT_EQ(result.exit_code, 0) << result.error;
  ASSERT_EQ(lines(result.out), 2);
  const json first = json::parse(result.out.substr(0, result.out.find('\n')));
  EXPECT_EQ(first["channel"], "a");
  EXPECT_EQ(first["text"], "hi");
  EXPECT_EQ(first["distance_m"], 0.5);
  EXPECT_TRUE(first["bearing_rad"].is_null());
}

TEST_F(Cli, SubWritesEachLineAtOnceIntoAPipe) {
  Program program(with_socket({"sub", "a"}));
  wait_for_subscriptions(1);
  daemon.deliver("hi");
  EXPECT_EQ(program.read_line(), "a: robot 0  \"hi\"  distance unknown  bearing unknown  hops 0");
  program.signal(SIGINT);
  const Result result = program.finish();
  EXPECT_EQ(result.exit_code, 128 + SIGINT);
  EXPECT_EQ(result.error, "");
}

TEST_F(Cli, SubEndsQuietlyWhenItsReaderHasGone) {
  Program program(with_socket({"sub", "a"}));
  wait_for_subscriptions(1);
  program.close_output();
  daemon.deliver("hi");
  const Result result = program.finish();
  EXPECT_EQ(result.exit_code, 1000 + SIGPIPE);
  EXPECT_EQ(result.error, "");
}

TEST_F(Cli, SubEndsWithoutAMessageWhenItsReaderHasGone) {
  Program program(with_socket({"sub", "a"}));
  wait_for_subscriptions(1);
  program.close_output();
  const Result result = program.finish();
  EXPECT_EQ(result.exit_code, 1000 + SIGPIPE);
  EXPECT_EQ(result.error, "");
}

TEST_F(Cli, SubTimeoutIsASuccessUnlessACountWasAsked) {
  EXPECT_EQ(run({"sub", "a", "-W", "0.05"}).exit_code, 0);
  const Result result = run({"sub", "a", "-W", "0.05", "-C", "1"});
  EXPECT_EQ(result.exit_code, 124);
  EXPECT_EQ(result.error, "swarmtalk-cli: heard 0 of 1 messages within the time of -W\n");
}

TEST_F(Cli, SubPassesItsFilters) {
  run({"sub", "a", "-W", "0.05", "--max-distance", "0.45", "--drop-unknown-distance", "--keep-last",
       "1"});
  const ipc::Subscribe body = daemon.received()[1].subscribe();
  EXPECT_FLOAT_EQ(body.max_distance_m(), 0.45F);
  EXPECT_TRUE(body.drop_unknown_distance());
  EXPECT_EQ(body.keep_last(), 1u);
}

TEST_F(Cli, SubOutlivesTheDaemonAndSaysSo) {
  Program program(with_socket({"sub", "a", "-C", "1"}));
  wait_for_subscriptions(1);
  daemon.kill();
  daemon.restart();
  wait_for_subscriptions(2);
  daemon.deliver("again");
  const Result result = program.finish();
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_NE(result.out.find("again"), std::string::npos);
  EXPECT_EQ(result.error.find("swarmtalk-cli: lost swarmtalkd"), 0u) << result.error;
}

TEST_F(Cli, StatusIsOneJsonObject) {
  const json status = json::parse(run({"status", "--json"}).out);
  EXPECT_EQ(status["version"], "fake");
  EXPECT_EQ(run({"status"}).out.find("swarmtalkd fake, robot 42"), 0u);
}

TEST_F(Cli, PoseIsSetInDegreesOrRadiansAlsoNegative) {
  EXPECT_EQ(run({"pose", "set", "-0.5", "-1", "-90deg"}).exit_code, 0);
  const ipc::SetPose pose = daemon.received().back().set_pose();
  EXPECT_TRUE(pose.fixed()) << "nobody repeats what is set by hand";
  EXPECT_FLOAT_EQ(pose.x_m(), -0.5F);
  EXPECT_FLOAT_EQ(pose.y_m(), -1);
  EXPECT_NEAR(pose.theta_rad(), -1.5708F, 1e-4);
  EXPECT_EQ(run({"pose", "set", "0", "0", "1.5"}).exit_code, 0);
  EXPECT_FLOAT_EQ(daemon.received().back().set_pose().theta_rad(), 1.5F);
  EXPECT_EQ(run({"pose", "set", "--age-out", "0", "0", "1.5"}).exit_code, 0);
  EXPECT_FALSE(daemon.received().back().set_pose().fixed());
  const Result bad = run({"pose", "set", "33", "0", "0"});
  EXPECT_EQ(bad.exit_code, 1);
  EXPECT_EQ(lines(bad.error), 1);
  EXPECT_EQ(run({"pose", "set", "0", "0", "90grad"}).exit_code, 2);
}

TEST_F(Cli, HelpVersionAndNeighborsAreTakenAsPeopleTypeThem) {
  const Result version = run({"-V"});
  EXPECT_EQ(version.exit_code, 0) << version.error;
  EXPECT_EQ(version.out, run({"--version"}).out);
  const Result help = run({"help", "pose", "set"});
  EXPECT_EQ(help.exit_code, 0) << help.error;
  EXPECT_NE(help.out.find("Usage: swarmtalk-cli pose set"), std::string::npos) << help.out;
  EXPECT_EQ(run({"help"}).exit_code, 0);
  EXPECT_EQ(run({"help", "nonsense"}).exit_code, 2);
  EXPECT_EQ(run({"neighbors", "--json"}).out, run({"neighbours", "--json"}).out);
  EXPECT_NE(run({"neighbour"}).error.find("did you mean 'neighbours'? See swarmtalk-cli --help\n"),
            std::string::npos);
}

TEST_F(Cli, WordsInAWrongPlaceAreToldWhereTheyBelong) {
  EXPECT_EQ(run({"--json", "status"}).error,
            "swarmtalk-cli: --json goes after status; see swarmtalk-cli status --help\n");
  EXPECT_EQ(run({"--count", "3", "sub", "a"}).error,
            "swarmtalk-cli: --count goes after sub; see swarmtalk-cli sub --help\n");
  const Result words = run({"pub", "hello", "good", "morning"});
  EXPECT_EQ(words.exit_code, 2);
  EXPECT_NE(words.error.find("; put a message of several words in quotes; see"), std::string::npos)
      << words.error;
}

TEST_F(Cli, SubPrintsTheTransmitterWhereTheFormatAsksForIt) {
  Program program(with_socket({"sub", "a", "-C", "1", "-F", "%s %t %p"}));
  wait_for_subscriptions(1);
  ipc::Deliver deliver;
  deliver.set_sender(3);
  deliver.set_transmitter(4);
  deliver.set_hops(1);
  deliver.set_payload("fire");
  daemon.deliver(deliver);
  const Result result = program.finish();
  EXPECT_EQ(result.exit_code, 0) << result.error;
  EXPECT_EQ(result.out, "3 4 fire\n");
}

TEST_F(Cli, HelpOfKeygenIsSilentAboutChannelsAndTheSocket) {
  const Result help = run({"keygen", "--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_EQ(help.out.find("socket"), std::string::npos) << help.out;
  EXPECT_NE(help.out.find("2 wrong usage."), std::string::npos) << help.out;
}

TEST_F(Cli, HelpFitsEightyColumnsWhereNoTerminalSaysElse) {
  for (const Strings& words : {Strings{"--help"}, {"sub", "--help"}, {"kilobot", "--help"}}) {
    std::istringstream text(run(words).out);
    for (std::string line; std::getline(text, line);) EXPECT_LE(line.size(), 80u) << line;
  }
}

TEST_F(Cli, PoseIsPrintedForPeopleAndForPrograms) {
  EXPECT_EQ(run({"pose", "get"}).out, "x 1.000 m  y 2.000 m  theta 172 deg  age 0 ms\n");
  EXPECT_EQ(json::parse(run({"pose", "get", "--json"}).out)["x_m"], 1.0);
}

TEST_F(Cli, WrongUsageIsOneLineAndExitCode2) {
  for (const Strings& arguments : {Strings{},
                                   {"pub"},
                                   {"pub", "c"},
                                   {"pub", "c", "x", "--hex"},
                                   {"sub"},
                                   {"sub", "a", "-C", "0"},
                                   {"sub", "a", "-W", "-1"},
                                   {"sub", "a", "-W", "inf"},
                                   {"sub", ""},
                                   {"sub", "a", "--max-distance", "nan"},
                                   {"sub", "a", "--max-distance", "-1"},
                                   {"sub", "a", "--keep-last", "-1"},
                                   {"sub", "a", "--keep-last", "0"},
                                   {"sub", "a", "-F", ""},
                                   {"sub", "a", "--fmt", ""},
                                   {"pub", "c", "x", "--fmt", ""},
                                   {"pub", "c", "x", "--repeat", "-1"},
                                   {"pub", "c", "x", "--ttl", "-1"},
                                   {"pose"},
                                   {"pose", "set", "a", "0", "0"},
                                   {"pose", "set", "inf", "0", "0"},
                                   {"nonsense"},
                                   {"--socket", "", "status"}}) {
    const Result result = run(arguments);
    EXPECT_EQ(result.exit_code, 2) << result.error;
    EXPECT_EQ(result.error.find("swarmtalk-cli: "), 0u) << result.error;
    EXPECT_EQ(lines(result.error), 1) << result.error;
  }
}

TEST_F(Cli, AChannelThatLooksLikeANumberMustBeOne) {
  for (const std::string word : {"65536", "99999999999999999999", "-1"}) {
    for (const Strings& arguments : {Strings{"pub", word, "x"}, {"sub", word}}) {
      const Result result = run(arguments);
      EXPECT_EQ(result.exit_code, 2);
      EXPECT_NE(result.error.find("channel numbers go from 0 to 65535, not " + word),
                std::string::npos)
          << result.error;
      EXPECT_EQ(lines(result.error), 1) << result.error;
    }
  }
  EXPECT_EQ(run({"pub", "065535", "x"}).exit_code, 0);
}

TEST_F(Cli, AChannelThatIsNoTextIsOneLine) {
  for (const Strings& arguments : {Strings{"pub", "caf\xe9", "x"}, {"sub", "caf\xe9"}}) {
    const Result result = run(arguments);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.error, "swarmtalk-cli: the name of a channel is not UTF-8 text\n");
  }
}

TEST_F(Cli, DataWithADashIsTakenBehindTwoOrTheUserIsToldSo) {
  const Result result = run({"pub", "hello", "-x y"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.error.find("pub CHANNEL -- DATA"), std::string::npos) << result.error;
  EXPECT_EQ(run({"pub", "hello", "--", "-x y"}).exit_code, 0);
  EXPECT_EQ(last_publish().payload(), "-x y");
}

TEST_F(Cli, ATimeTooLongToCountIsForEver) {
  int subscriptions = 0;
  for (const char* time : {"1e10", "1e300"}) {
    EXPECT_EQ(run({"pub", "c", "x", "-W", time}).exit_code, 0) << time;
    Program program(with_socket({"sub", "a", "-C", "1", "-W", time}));
    wait_for_subscriptions(++subscriptions);
    daemon.deliver("hi");
    EXPECT_EQ(program.finish().exit_code, 0) << time;
  }
}

TEST_F(Cli, StandardInputThatNoMessageCanHoldIsNotGivenAFalseLength) {
  const Result result = run({"pub", "c", "-"}, std::string(300'000, 'x'));
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.error,
            "swarmtalk-cli: standard input has more than 262144 bytes; channel c carries at most "
            "100\n");
}

TEST_F(Cli, PubUntilASignalOutlivesTheDaemon) {
  Program program(with_socket({"pub", "c", "x", "--repeat", "0", "--rate", "100"}));
  wait_for_publications(2);
  daemon.kill();
  EXPECT_EQ(program.read_error_line().find("swarmtalk-cli: lost swarmtalkd"), 0u);
  daemon.restart();
  EXPECT_NE(program.read_error_line().find("connected to swarmtalkd again"), std::string::npos);
  wait_for_publications(daemon.count(is_publish) + 2);
  program.signal(SIGTERM);
  const Result result = program.finish();
  EXPECT_EQ(result.exit_code, 128 + SIGTERM);
  EXPECT_EQ(result.error, "");
}

TEST_F(Cli, PubUntilASignalOutlivesALinkThatIsDown) {
  Program program(with_socket({"pub", "c", "x", "--repeat", "0", "--rate", "100"}));
  wait_for_publications(2);
  daemon.refuse_messages(ipc::ERROR_LINK_DOWN, "link wlan0 is down");
  wait_for_publications(daemon.count(is_publish) + 3);
  daemon.refuse_messages(ipc::ERROR_UNSPECIFIED, "");
  wait_for_publications(daemon.count(is_publish) + 3);
  program.signal(SIGTERM);
  const Result result = program.finish();
  EXPECT_EQ(result.exit_code, 128 + SIGTERM);
  EXPECT_EQ(result.error,
            "swarmtalk-cli: link wlan0 is down\nswarmtalk-cli: messages leave again\n");
}

TEST_F(Cli, PubOfACountEndsAtAnInterruption) {
  daemon.refuse_messages(ipc::ERROR_LINK_DOWN, "link wlan0 is down");
  const Result result = run({"pub", "c", "x", "--repeat", "3"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.error, "swarmtalk-cli: link wlan0 is down\n");
}

TEST_F(Cli, AFullDiskIsOneLineAndExitCode1) {
  for (const Strings& arguments : {Strings{"status"}, {"pose", "get"}, {"sub", "a"}}) {
    Program program(with_socket(arguments), "/dev/full");
    if (arguments[0] == "sub") {
      wait_for_subscriptions(1);
      daemon.deliver("one");
    }
    const Result result = program.finish();
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.error,
              "swarmtalk-cli: cannot write to standard output: No space left on device\n");
  }
}

TEST_F(Cli, StandardStreamsThatAreClosedAreNoPlaceForASocket) {
  const std::string command = std::string("exec ") + SWARMTALK_CLI + " --socket " + path;
  Program program({"-c", command + " sub x <&- 2>&-"}, nullptr, "/bin/sh");
  wait_for_subscriptions(1);
  EXPECT_EQ(program.descriptor(0), "/dev/null");
  EXPECT_EQ(program.descriptor(2), "/dev/null");
  program.signal(SIGTERM);
  program.finish();
}

TEST_F(Cli, NoDaemonIsExitCode3WithTheRemedy) {
  daemon.kill();
  for (const Strings& arguments : {Strings{"pub", "c", "x"}, {"sub", "c"}, {"status"}}) {
    const Result result = run(arguments);
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_EQ(lines(result.error), 1);
    EXPECT_NE(result.error.find("start swarmtalkd"), std::string::npos) << result.error;
  }
}

TEST_F(Cli, SocketComesFromTheEnvironmentToo) {
  ::setenv("SWARMTALK_SOCKET", path.c_str(), 1);
  Program program({"status"});
  EXPECT_EQ(program.finish().exit_code, 0);
  ::unsetenv("SWARMTALK_SOCKET");
}

TEST_F(Cli, TheFirstProgramSpeaksOfDistanceOnlyWhenItIsKnown) {
  ::setenv("SWARMTALK_SOCKET", path.c_str(), 1);
  Program program({}, nullptr, SWARMTALK_FIRST_PROGRAM);
  ::unsetenv("SWARMTALK_SOCKET");
  wait_for_subscriptions(1);
  daemon.deliver("hi");
  ipc::Deliver near;
  near.set_payload("hi");
  near.set_distance_m(0.5F);
  daemon.deliver(near);
  EXPECT_EQ(program.read_line(), "robot 0 says hi");
  EXPECT_EQ(program.read_line(), "robot 0 says hi, 0.5 m away");
  program.signal(SIGTERM);
  program.finish();
}

}  // namespace
}  // namespace swarmtalk::test
