// What `swarmtalk-cli channels`, `hz`, `decode` and `pose watch` understand.
#include <CLI/CLI.hpp>
#include <memory>

#include "cli/common/checks.hpp"
#include "cli/common/looking.hpp"

namespace swarmtalk::cli {
namespace {

void add_channels(CLI::App& app, Common& common, Verb& verb) {
  auto arguments = std::make_shared<ChannelsArguments>();
  auto* command = app.add_subcommand(
      "channels", "Print the channels on the air and here: who publishes, how much");
  command->add_flag("--json", common.is_json, "one JSON object");
  command->add_option("-W,--timeout", arguments->seconds, "seconds to listen")
      ->check(above_zero())
      ->capture_default_str();
  command->callback([&common, &verb, arguments] {
    verb = [&common, arguments] { return channels(common, *arguments); };
  });
}

void add_hz(CLI::App& app, Common& common, Verb& verb) {
  auto arguments = std::make_shared<HzArguments>();
  auto* command = app.add_subcommand("hz", "Print how often messages come, by channel and sender");
  command->add_option("CHANNEL", arguments->channels)->required()->check(channel());
  command->add_flag("--json", common.is_json, "one JSON object a report");
  command->add_option("--period", arguments->seconds, "seconds that a report covers")
      ->check(period())
      ->capture_default_str();
  command->add_option("-C,--count", arguments->count, "end after so many reports")->check(count());
  command->callback([&common, &verb, arguments] {
    verb = [&common, arguments] { return hz(common, *arguments); };
  });
}

void add_decode(CLI::App& app, Common& common, Verb& verb) {
  auto arguments = std::make_shared<DecodeArguments>();
  auto* command = app.add_subcommand(
      "decode", "Print the fields of air frames; needs no daemon (docs/wire-format.md)");
  command
      ->add_option(
          "HEX", arguments->frames,
          "frames in hexadecimal, with or without an Ethernet header; -: a frame a line on "
          "standard input")
      ->required();
  command->add_option("--packet", arguments->profile, "HEX are bare packets of this profile")
      ->check(CLI::IsMember({"wifi", "kilobot", "classic2020", "footbot"}));
  command->add_flag("--json", common.is_json, "one JSON object a frame");
  command->callback([&common, &verb, arguments] {
    verb = [&common, arguments] { return decode(common, *arguments); };
  });
}

void add_pose_watch(CLI::App& app, Common& common, Verb& verb) {
  auto arguments = std::make_shared<PoseWatchArguments>();
  auto* command = app.get_subcommand("pose")->add_subcommand(
      "watch", "Print the pose that the daemon has, again and again");
  command->add_flag("--json", common.is_json, "one JSON object a line");
  command->add_option("--period", arguments->period_s, "seconds between two lines")
      ->check(period())
      ->capture_default_str();
  command->add_option("-C,--count", arguments->count, "end after so many lines")->check(count());
  command->callback([&common, &verb, arguments] {
    verb = [&common, arguments] { return watch_pose(common, *arguments); };
  });
}

void add_ping(CLI::App& app, Common& common, Verb& verb) {
  auto arguments = std::make_shared<PingArguments>();
  auto* command = app.add_subcommand(
      "ping", "Ask a robot for answers, over some hops: round trip, and losses there and back");
  auto* robot = command->add_option("ROBOT", arguments->robot, "its node id")->check(node_id());
  auto* answer = command
                     ->add_flag("--answer", arguments->answers,
                                "answer questions for this robot, until a signal")
                     ->excludes(robot);
  command
      ->add_flag("--by-hop", arguments->is_by_hop,
                 "ask the robots on the way as well: round trip and losses of each hop")
      ->excludes(answer);
  command->add_flag("--json", common.is_json, "one JSON object a question")->excludes(answer);
  command->add_option("-c,-C,--count", arguments->count, "end after so many questions")
      ->check(count())
      ->excludes(answer);
  command
      ->add_option("--period", arguments->period_s,
                   "seconds between questions, within which the answer must come")
      ->check(period())
      ->capture_default_str()
      ->excludes(answer);
  command->add_option("--ttl", arguments->ttl, "hops after the first, there and back")
      ->check(ttl())
      ->capture_default_str()
      ->excludes(answer);
  command->callback([&common, &verb, arguments, robot] {
    if (robot->count() == 0 && !arguments->answers) {
      throw CLI::RequiredError("ROBOT, or --answer,");
    }
    verb = [&common, arguments] { return ping(common, *arguments); };
  });
}

}  // namespace

void add_looking(CLI::App& app, Common& common, Verb& verb) {
  add_channels(app, common, verb);
  add_hz(app, common, verb);
  add_decode(app, common, verb);
  add_pose_watch(app, common, verb);
  add_ping(app, common, verb);
}

}  // namespace swarmtalk::cli
