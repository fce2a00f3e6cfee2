// What `swarmtalk-cli doctor` and `survey` understand.
#include <CLI/CLI.hpp>
#include <memory>

#include "cli/common/checks.hpp"
#include "cli/doctor/doctor.hpp"
#include "cli/doctor/survey.hpp"

namespace swarmtalk::cli::doctor {
namespace {

void add_expected(CLI::App& command, Expected& expected) {
  command.add_option("--network", expected.network, "the network that the radio should be in");
  command.add_option("--channel", expected.channel, "the channel that it should be on")
      ->check(whole_number(233, 1));
  command.add_option("--mode", expected.mode, "the mode that it should be in")
      ->check(CLI::IsMember({"managed", "ibss", "mesh", "ap", "ocb"}));
  command.add_option("--country", expected.country, "the country that should be set, as in DE")
      ->check([](const std::string& word) {
        return word.size() == 2 ? std::string() : "a country has two letters, not " + word;
      });
}

}  // namespace

void add_doctor(CLI::App& app, Common& common, Verb& verb) {
  auto arguments = std::make_shared<DoctorArguments>();
  auto* command = app.add_subcommand(
      "doctor",
      "Find out why robots do not hear each other; exit code 0: all is well, 1: findings, "
      "2: no finding, but something could not be looked at");
  auto* peer = command
                   ->add_option("--peer", arguments->peer.robot,
                                "also test with this robot, through the air; it runs ping --answer")
                   ->check(node_id());
  command
      ->add_option("--address", arguments->peer.address,
                   "the other robot's IP address or name: tells a filter from isolation")
      ->needs(peer);
  command
      ->add_option("--peer-report", arguments->peer.report_file,
                   "what doctor --json printed on the other robot; -: standard input")
      ->needs(peer);
  command->add_flag("--fix", arguments->has_fix,
                    "set what can be set with your rights, and say what was done");
  command->add_flag("--json", common.is_json, "one JSON object");
  command->add_option("--interface", arguments->interface, "look at this interface too");
  add_expected(*command, arguments->expected);
  command
      ->add_option("--config", arguments->config_file,
                   "the configuration to check where no daemon runs")
      ->type_name("FILE");
  command->add_option("--period", arguments->seconds, "seconds to watch counters")
      ->check(above_zero())
      ->capture_default_str();
  command->callback([&common, &verb, arguments] {
    verb = [&common, arguments] { return doctor(common, *arguments); };
  });
}

void add_survey(CLI::App& app, Common& common, Verb& verb) {
  auto arguments = std::make_shared<SurveyArguments>();
  auto* command = app.add_subcommand(
      "survey",
      "Write loss, delay and signal by distance to another robot as CSV, while they move");
  command
      ->add_option("--peer", arguments->robot, "the other robot's node id; it runs ping --answer")
      ->required()
      ->check(node_id());
  command->add_option("FILE", arguments->file, "where to; default: standard output");
  command->add_option("--rate", arguments->rate_hz, "questions a second")
      ->check(above_zero())
      ->capture_default_str();
  command->add_option("--period", arguments->period_s, "seconds that a line covers")
      ->check(period())
      ->capture_default_str();
  command->add_option("-C,--count", arguments->count, "end after so many lines")->check(count());
  command->callback([&common, &verb, arguments] {
    verb = [&common, arguments] { return survey(common, *arguments); };
  });
}

}  // namespace swarmtalk::cli::doctor
