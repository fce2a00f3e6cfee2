// What swarmtalk-cli says of a daemon that dies, of lines, of robots that do not answer: the
// program itself against a fake daemon.
#include <gtest/gtest.h>

#include <array>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <tuple>
#include <utility>

#include "frame/air_frame.hpp"
#include "tests/unit/cli/cli_fixture.hpp"

namespace swarmtalk::test {
namespace {

using nlohmann::json;

class CliLooking : public Cli {
 protected:
  /// Kills the daemon once it has heard `matches` of the command: what the command says then.
  Result loses_the_daemon(const Strings& arguments,
                          const std::function<bool(const ipc::Envelope&)>& matches) {
    Program program(with_socket(arguments));
    wait_for(matches, daemon.count(matches) + 1);
    daemon.kill();
    const Result result = program.finish();
    daemon.restart();
    EXPECT_EQ(result.exit_code, 3) << arguments[0] << ": " << result.error;
    return result;
  }
  /// A file beside the socket, which goes with it.
  std::string file(const std::string& text) const {
    const auto place = std::filesystem::path(path).parent_path() / "lines";
    std::ofstream(place) << text;
    return place.string();
  }
  std::vector<std::string> published() {
    std::vector<std::string> payloads;
    for (const auto& envelope : daemon.received()) {
      if (envelope.has_publish()) payloads.push_back(envelope.publish().payload());
    }
    return payloads;
  }
};

TEST_F(CliLooking, ADaemonThatDiesEndsScreensAndValuesWithOneLine) {
  const auto is_status = [](const auto& envelope) { return envelope.has_get_status(); };
  const auto is_neighbours = [](const auto& envelope) { return envelope.has_get_neighbours(); };
  const std::string closed = "swarmtalk-cli: swarmtalkd closed the connection\n";
  EXPECT_EQ(loses_the_daemon({"top", "--json", "--period", "0.1"}, is_status).error, closed);
  EXPECT_EQ(loses_the_daemon({"radar", "--json", "--period", "0.1"}, is_neighbours).error, closed);
  EXPECT_EQ(loses_the_daemon({"harvest", "-W", "60"}, is_publish).error, closed);
}

TEST_F(CliLooking, AHarvestThatFindsNothingSaysSo) {
  const Result all = run({"harvest", "-W", "0.1"});
  EXPECT_EQ(all.exit_code, 0);
  EXPECT_EQ(all.out, "");
  EXPECT_EQ(all.error,
            "swarmtalk-cli: nobody has answered: no program within reach offers a value, as "
            "swarmtalk-cli harvest --offer KEY=VALUE does, or question or answers were lost: ask "
            "again\n");
  const Result some = run({"harvest", "bat", "-W", "0.1"});
  EXPECT_NE(some.error.find("a value whose key begins with 'bat', as "), std::string::npos)
      << some.error;
}

TEST_F(CliLooking, ADaemonThatHasJustBegunHasHeardNobodyYet) {
  std::uint64_t uptime_ms = 2999;
  daemon.says = [&](const ipc::Envelope& asked) {
    std::vector<ipc::Envelope> answer(asked.has_get_status() || asked.has_get_neighbours() ? 1 : 0);
    if (asked.has_get_neighbours()) answer[0].mutable_neighbours();
    if (asked.has_get_status()) answer[0].mutable_status()->set_uptime_ms(uptime_ms);
    return answer;
  };
  const Result early = run({"neighbours"});
  EXPECT_EQ(early.out, "nobody was heard yet: this daemon began less than 3 s ago; ask again\n");
  EXPECT_EQ(run({"neighbours", "--json"}).out, "{\"neighbours\":[]}\n");
  uptime_ms = 3000;
  EXPECT_EQ(run({"neighbours"}).out.find("nobody was heard within the last 10 s"), 0u);
}

TEST_F(CliLooking, ADaemonThatDiesEndsRatesWithOneLine) {
  const auto is_subscribe = [](const auto& envelope) { return envelope.has_subscribe(); };
  for (const Strings& more : {Strings{}, {"--json"}, {"-C", "1000"}}) {
    Strings words{"hz", "a", "--period", "0.1"};
    words.insert(words.end(), more.begin(), more.end());
    const std::string error = loses_the_daemon(words, is_subscribe).error;
    EXPECT_EQ(error.find("swarmtalk-cli: lost swarmtalkd: "), 0u) << error;
    EXPECT_EQ(lines(error), 1) << error;
    EXPECT_EQ(error.find(';'), std::string::npos) << "nothing is promised: " << error;
  }
}

TEST_F(CliLooking, WhoHasLostTheDaemonBetweenLinesIsToldHowManyHaveLeft) {
  Program program(with_socket({"pub", "a", "--lines"}));
  program.write("one\ntwo\n");
  wait_for_publications(2);
  daemon.kill();
  program.write("three\n");
  const Result result = program.finish();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_EQ(
      result.error.find("swarmtalk-cli: line 3 of standard input was not sent: swarmtalkd is gone"),
      0u)
      << result.error;
  EXPECT_NE(result.error.find("; 2 lines before it have been sent"), std::string::npos)
      << result.error;
  EXPECT_EQ(lines(result.error), 1) << result.error;
}

TEST_F(CliLooking, ARobotThatCouldNotBeAskedIsNotCalledOutOfReach) {
  const Result lost = loses_the_daemon({"ping", "2", "-C", "1", "--period", "5"}, is_publish);
  EXPECT_NE(lost.error.find("could not be asked any more: this robot's swarmtalkd is gone"),
            std::string::npos)
      << lost.error;
  EXPECT_EQ(lost.error.find("out of reach"), std::string::npos) << lost.error;
}

TEST_F(CliLooking, ARobotThatDoesNotAnswerIsToldWithWhatMakesItAnswer) {
  const Result silent = run({"ping", "2", "-C", "2", "--period", "0.2"});
  EXPECT_EQ(silent.exit_code, 1);
  EXPECT_EQ(lines(silent.out), 3) << silent.out;
  EXPECT_NE(silent.out.find("2  no answer within 0.20 s\n2 sent, 0 answered, 100 % lost: 0 on the "
                            "way there, 0 back, 2 unknown where\n"),
            std::string::npos)
      << silent.out;
  EXPECT_EQ(lines(silent.error), 1) << silent.error;
  for (const char* word : {"robot 2 has not answered", "report = true", "ping --answer"}) {
    EXPECT_NE(silent.error.find(word), std::string::npos) << silent.error;
  }
  const Result own = run({"ping", "42"});
  EXPECT_EQ(own.exit_code, 2);
  EXPECT_EQ(own.error, "swarmtalk-cli: robot 42 is this one; ping another\n");
}

/// What daemons of a row answer to ping: robot 2 hears the asker, 3 hears 2, and so on.
class Row {
 public:
  /// For FakeDaemon::says.
  std::vector<ipc::Envelope> say(const ipc::Envelope& asked) {
    if (asked.has_advertise() || asked.has_subscribe()) ++ids_;
    if (asked.has_subscribe()) subscription_ = ids_;
    if (!asked.has_publish()) return {};
    std::istringstream words(asked.publish().payload());
    std::string word;
    std::string run;
    std::string sequence;
    std::uint32_t robot = 0;
    words >> word >> run >> sequence >> robot;
    const std::string hops = std::to_string(robot - 2);
    const std::string via = robot == 2 ? "42" : std::to_string(robot - 1);
    std::vector<ipc::Envelope> said(2);
    said[0].mutable_sent()->set_publisher_id(asked.publish().publisher_id());
    said[0].mutable_sent()->set_publish_number(asked.publish().publish_number());
    ipc::Deliver& pong = *said[1].mutable_deliver();
    pong.set_subscription_id(subscription_);
    pong.set_sender(robot);
    pong.set_hops(robot - 2);
    pong.set_payload("pong " + run + " " + sequence + " " + std::to_string(++heard_[{run, robot}]) +
                     " " + hops + " " + via);
    return said;
  }

 private:
  std::uint32_t ids_ = 0;  // that the daemon has given
  std::uint32_t subscription_ = 0;
  std::map<std::pair<std::string, std::uint32_t>, std::uint32_t> heard_;  // by run and robot
};

TEST_F(CliLooking, PingByHopTellsOfEachRobotOnTheWay) {
  Row row;
  daemon.says = [&](const ipc::Envelope& asked) { return row.say(asked); };
  Program program(with_socket({"ping", "4", "--by-hop", "--period", "0.1", "--json"}));
  json told;
  for (int line = 0; line < 600; ++line) {  // the first of them name fewer robots
    told = json::parse(program.read_line());
    if (told["hops"].size() == 3 && told["hops"][0]["answered"] > 0) break;
  }
  program.signal(SIGINT);
  program.finish();
  EXPECT_EQ(told["hops_there"], 2);
  EXPECT_EQ(told["hops_back"], 2);
  EXPECT_EQ(told["heard_there"], told["told_of"]);
  ASSERT_EQ(told["hops"].size(), 3u) << told;
  for (std::uint32_t i = 0; i < 3; ++i) {
    EXPECT_EQ(told["hops"][i]["robot"], i + 2);
    EXPECT_EQ(told["hops"][i]["hops_there"], i);
    EXPECT_GT(told["hops"][i]["answered"], 0);
    EXPECT_GT(told["hops"][i]["median_ms"], 0);
  }
  EXPECT_EQ(told["hops"][2]["answered"], told["answered"]);
}

TEST_F(CliLooking, PingByHopEndsWithALineForEachRobotOnTheWay) {
  Row row;
  daemon.says = [&](const ipc::Envelope& asked) { return row.say(asked); };
  Program program(with_socket({"ping", "3", "--by-hop", "--period", "0.1"}));
  wait_for_publications(20);
  program.signal(SIGINT);
  const std::string out = program.finish().out;
  const std::string figures =
      "  [0-9]+\\.[0-9][0-9] ms  [0-9]+ sent, [0-9]+ answered, [0-9]+ % lost";
  for (const char* robot : {"robot 2: directly", "robot 3: over 1 robot"}) {
    EXPECT_TRUE(std::regex_search(out, std::regex("\n" + (robot + figures)))) << out;
  }
}

TEST_F(CliLooking, PingEndsAsPingsDo) {
  Row row;
  daemon.says = [&](const ipc::Envelope& asked) { return row.say(asked); };
  const Result one = run({"ping", "3", "-c", "1", "--period", "30"});  // ends with the answer
  EXPECT_EQ(one.exit_code, 0);
  const std::string ms = "[0-9]+\\.[0-9][0-9]";
  EXPECT_TRUE(std::regex_match(
      one.out, std::regex("robot 3: 1  " + ms + " ms  there over 1 robot, back over 1 robot\n" +
                          "1 sent, 1 answered, 0 % lost\n" + "round trip min/avg/max " + ms + "/" +
                          ms + "/" + ms + " ms\n")))
      << one.out;
}

TEST_F(CliLooking, PubSaysWhereThereIsNoRedundancyAndSends) {
  const Result none = run({"pub", "3", "x", "--redundancy", "2"});
  EXPECT_EQ(none.exit_code, 0);
  EXPECT_TRUE(std::regex_search(none.error,
                                std::regex("without repair packets.*profile \"wifi\".*--copies")))
      << none.error;
  EXPECT_EQ(published(), Strings{"x"});
  const Result too_much = run({"pub", "3", "x", "--redundancy", "13"});
  EXPECT_EQ(too_much.exit_code, 2);
  EXPECT_NE(too_much.error.find("auto, or 1 to 12, not 13"), std::string::npos) << too_much.error;
}

TEST_F(CliLooking, PubSendsAMessageALine) {
  EXPECT_EQ(run({"pub", "a", "--lines", "--file", file("one\n\nthree"), "--rate", "100"}).exit_code,
            0);
  EXPECT_EQ(published(), (Strings{"one", "", "three"}));
  const Result wrong = run({"pub", "a", "--lines", "--file", file("1 2\n1\n"), "--fmt", "<HH"});
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_EQ(published().size(), 4u) << "the line before was sent";
  EXPECT_EQ(lines(wrong.error), 1) << wrong.error;
  EXPECT_EQ(wrong.error.find("swarmtalk-cli: line 2 of "), 0u) << wrong.error;
  EXPECT_NE(wrong.error.find(": format <HH takes 2 values, not 1; 1 line before it has"),
            std::string::npos)
      << wrong.error;
}

TEST_F(CliLooking, LinesOfOtherSystemsAreTheSameMessages) {
  const std::string mark = "\xEF\xBB\xBF";
  const Strings hex{"pub", "a", "--lines", "--hex"}, raw{"pub", "a", "--lines"};
  const Strings values{"pub", "a", "--lines", "--fmt", "<BB"};
  const std::string zeros{"g\0o\0", 4};
  std::vector<std::string> all;
  for (const auto& [command, input, messages] :
       std::vector<std::tuple<Strings, std::string, Strings>>{
           {raw, "go\r\n\r\nstop", {"go", "", "stop"}},
           {raw, mark + "go\nstop\n", {"go", "stop"}},
           {raw, "go\n" + mark + "stop\n", {"go", mark + "stop"}},
           {raw, "g\ro\nstop\r\r\n", {"g\ro", "stop\r"}},
           {raw, zeros + "\n\xFF\n", {zeros, "\xFF"}},
           {hex, "676f\r\n73:74\t6f 70\r\n", {"go", "stop"}},
           {hex, mark + "67 6f\n", {"go"}},
           {values, mark + "103 111\r\n115, 116\r\n", {"go", "st"}}}) {
    const Result done = run(command, input);
    EXPECT_EQ(done.exit_code, 0) << done.error;
    all.insert(all.end(), messages.begin(), messages.end());
    EXPECT_EQ(published(), all) << json(command) << ' ' << testing::PrintToString(input);
  }
}

TEST_F(CliLooking, ALineThatCannotBeSentIsNamedWithHowManyWere) {
  const Strings hex{"pub", "a", "--lines", "--hex"}, raw{"pub", "a", "--lines"};
  const Strings values{"pub", "a", "--lines", "--fmt", "<BB"};
  for (const auto& [command, input, line] :
       std::vector<std::tuple<Strings, std::string, std::size_t>>{
           {raw, "one\ntwo\n" + std::string(20'000, 'x') + "\nfour\n", 3},
           {raw, "one\r\n" + std::string(300'000, 'x') + "\r\n", 2},
           {raw, std::string("\xFF\xFEg\0o\0\n\0", 8), 1},
           {hex, "00\n\n11\n", 2},
           {hex, "00\r\n11\r\n\t \r\n", 3},
           {hex, "00\nx0\n", 2},
           {hex,
            std::string("0\0"
                        "0\0\n\0",
                        6),
            1},
           {hex, "00\n\xEF\xBB\xBF\n", 2},
           {hex, std::string("00\n\0\n", 5), 2},
           {hex,
            std::string("00\n0\0"
                        "1\n",
                        7),
            2},
           {hex, "00\n01\r02\r", 2},
           {values, "1 2\r3 4\r", 1},
           {raw, std::string("\0\0\xFE\xFF\0\0\0g\0\0\0\n", 12), 1},
           {values, "1 2\n\n", 2},
           {values, "1 2\n1 256\n", 2}}) {
    const std::size_t before = published().size();
    const Result done = run(command, input);
    EXPECT_EQ(done.exit_code, 1) << done.error;
    EXPECT_EQ(lines(done.error), 1) << done.error;
    EXPECT_EQ(done.error.find("swarmtalk-cli: line " + std::to_string(line) +
                              " of standard input was not sent: "),
              0u)
        << done.error;
    EXPECT_EQ(published().size() - before, line - 1) << done.error;
    const std::string sent = line == 1   ? "; nothing has been sent\n"
                             : line == 2 ? "; 1 line before it has been sent\n"
                                         : "; 2 lines before it have been sent\n";
    EXPECT_TRUE(done.error.ends_with(sent)) << done.error;
  }
}

TEST_F(CliLooking, DecodeReadsLinesOfOtherSystemsAndNamesThoseThatAreNoFrames) {
  const Strings words{"decode", "-", "--packet", "wifi", "--json"};
  const std::string packet(2 * 24, '0');
  for (const std::string& input :
       {packet + "\r\n\r\n" + packet + "\r\n", "\xEF\xBB\xBF" + packet + "\n \n" + packet}) {
    const Result done = run(words, input);
    EXPECT_EQ(done.exit_code, 0) << done.error;
    EXPECT_EQ(lines(done.out), 2) << done.error;
  }
  const Result one_line = run(words, packet + "\r" + packet + "\r");
  EXPECT_EQ(one_line.exit_code, 2);
  EXPECT_NE(one_line.error.find("line 1: it has a carriage return"), std::string::npos);
  const Result wrong = run(words, packet + "\n\nzz\r\n" + packet + "\n00\n");
  EXPECT_EQ(lines(wrong.out), 3) << "a short one, too";
  EXPECT_NE(wrong.error.find(": line 3: 'zz' is not hexadecimal"), std::string::npos)
      << wrong.error;
  EXPECT_NE(wrong.error.find(": line 5: a frame of 1 byte"), std::string::npos) << wrong.error;
  const Result wide = run(words, std::string("\xFF\xFE"
                                             "0\0"
                                             "0\0\n\0",
                                             8));
  EXPECT_EQ(wide.exit_code, 2);
  EXPECT_NE(wide.error.find("standard input is UTF-16; save it as UTF-8"), std::string::npos);
}

TEST_F(CliLooking, AKeyFileOfAnotherSystemIsTakenOrNamed) {
  const std::string digits(64, '1');
  std::string wide = "\xFF\xFE";
  for (const char c : digits) wide += {c, '\0'};
  const auto error_with = [&](const std::string& key) {
    return run({"capture", path + ".pcap", "--from", path + ".none", "--unseal", file(key)}).error;
  };
  EXPECT_NE(error_with("\xEF\xBB\xBF" + digits + "\r\n").find("cannot read " + path + ".none"),
            std::string::npos);
  for (const std::string& key : {wide, wide.substr(2)}) {
    EXPECT_NE(error_with(key).find(" is UTF-16; save it as UTF-8\n"), std::string::npos);
  }
}

TEST_F(CliLooking, HzCountsAChannelThatIsNamedTwiceOnce) {
  Program program(with_socket({"hz", "a", "a", "--json", "--period", "0.2"}));
  wait_for([](const auto& envelope) { return envelope.has_unsubscribe(); }, 1);
  ipc::Deliver deliver;
  deliver.set_sender(3);
  for (int i = 0; i < 5; ++i) daemon.deliver(deliver);
  deliver.set_sender(4);  // after all of these
  daemon.deliver(deliver);
  int heard = 0;
  for (bool is_end = false; !is_end;) {
    const std::string line = program.read_line();
    ASSERT_FALSE(line.empty()) << "it has ended";
    const json report = json::parse(line);
    for (const json& sender : report["senders"]) {
      if (sender["sender"] == 3) heard += sender["messages"].get<int>();
      is_end = is_end || sender["sender"] == 4;
    }
  }
  EXPECT_EQ(heard, 5);
  program.signal(SIGINT);
  program.finish();
}

TEST_F(CliLooking, ChannelsSaysWhatItsFiguresLeaveOut) {
  constexpr unsigned kPublishers = 4096 + 2;
  std::vector<std::string> frames;
  for (unsigned number = 1; number <= kPublishers;) {
    std::array<std::uint8_t, 1400> buffer{};
    frame::FrameWriter writer(buffer, {}, buffer.size());
    for (; number <= kPublishers; ++number) {
      std::array<std::uint8_t, 24> packet{};  // the number all over its header
      for (std::size_t i = 0; i < packet.size(); ++i) {
        packet[i] = static_cast<std::uint8_t>(i % 2 == 0 ? number : number >> 8);
      }
      if (!writer.append(packet)) break;
    }
    const auto bytes = writer.finish();
    frames.emplace_back(bytes.begin(), bytes.end());
  }
  daemon.says = [&](const ipc::Envelope& request) -> std::vector<ipc::Envelope> {
    if (!request.has_capture()) return {};
    std::vector<ipc::Envelope> envelopes(1 + frames.size());
    envelopes[0].mutable_done();
    for (std::size_t i = 0; i < frames.size(); ++i) {
      envelopes[1 + i].mutable_captured()->set_frame(frames[i]);
    }
    envelopes[2].mutable_captured()->set_missed(3);
    return envelopes;
  };
  const std::string unlisted =
      "swarmtalk-cli: more than 4096 publishers were heard; of the others 2 packets are not "
      "counted\n";
  const std::string missed =
      "swarmtalk-cli: 3 frames were not looked at: this program was too slow for all that is on "
      "the air\n";
  EXPECT_EQ(run({"channels", "-W", "0.1"}).error, unlisted + missed);
  const Result as_json = run({"channels", "-W", "0.1", "--json"});
  EXPECT_EQ(as_json.error, unlisted);
  EXPECT_EQ(json::parse(as_json.out)["missed_frames"], 3);
}

TEST_F(CliLooking, ScreensWithoutATerminalSayWhatPrintsInstead) {
  for (const std::string verb : {"top", "radar"}) {
    const Result result = run({verb});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_NE(result.error.find(verb + " --once"), std::string::npos) << result.error;
    EXPECT_EQ(lines(result.error), 1) << result.error;
  }
}

}  // namespace
}  // namespace swarmtalk::test
