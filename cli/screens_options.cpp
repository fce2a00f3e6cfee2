// What `swarmtalk-cli top` and `radar` understand.
#include <CLI/CLI.hpp>
#include <memory>

#include "cli/common/checks.hpp"
#include "cli/common/looking.hpp"

namespace swarmtalk::cli {
namespace {

CLI::App* add_screen(CLI::App& app, Common& common, ScreenArguments& arguments, const char* name,
                     const char* text) {
  auto* command = app.add_subcommand(name, text);
  auto* json = command->add_flag("--json", common.is_json, "one JSON object a line, each period");
  auto* once = command->add_flag("--once", arguments.is_once, "print once as text, and end");
  command->add_option("--period", arguments.period_s, "seconds between two looks")
      ->check(period())
      ->capture_default_str();
  command->add_option("-C,--count", arguments.count, "with --json: end after so many lines")
      ->check(count())
      ->needs(json)
      ->excludes(once);
  return command;
}

}  // namespace

void add_screens(CLI::App& app, Common& common, Verb& verb) {
  auto of_top = std::make_shared<ScreenArguments>();
  auto* command = add_screen(app, common, *of_top, "top",
                             "Show channels, programs and neighbours, with rates and losses, live");
  auto* const whole = command->get_option("--json");  // which holds everything
  command
      ->add_option("--filter", of_top->filter,
                   "only what has this in its name; a channel's whole name also finds its number")
      ->excludes(whole);
  command->add_option("--sort", of_top->sort, "by name, rate or lost; default: name")
      ->check(CLI::IsMember({"name", "rate", "lost"}))
      ->excludes(whole);
  command->callback(
      [&common, &verb, of_top] { verb = [&common, of_top] { return top(common, *of_top); }; });
  auto of_radar = std::make_shared<ScreenArguments>();
  command = add_screen(app, common, *of_radar, "radar",
                       "Show who is heard, where and how fresh, around this robot");
  command->add_option("--range", of_radar->range_m, "metres to the outer ring; default: as needed")
      ->check(above_zero())
      ->excludes(command->get_option("--json"));
  command->callback([&common, &verb, of_radar] {
    verb = [&common, of_radar] { return radar(common, *of_radar); };
  });
}

}  // namespace swarmtalk::cli
