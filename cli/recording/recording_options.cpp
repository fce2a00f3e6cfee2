// What `swarmtalk-cli record` and `play` understand.
#include <CLI/CLI.hpp>
#include <memory>

#include "cli/common/checks.hpp"
#include "cli/recording/recording.hpp"

namespace swarmtalk::cli {
namespace {

void add_record(CLI::App& app, const Common& common, Verb& verb) {
  auto arguments = std::make_shared<RecordArguments>();
  auto* command = app.add_subcommand(
      "record", "Record what is heard, with all that was sensed, as an MCAP file or as lines");
  auto* const file = command->add_option(
      "FILE", arguments->file, "the recording; lines of --jsonl go to standard output instead");
  command->add_option("-c,--channels", arguments->channels, "only these; default: all")
      ->delimiter(',')
      ->allow_extra_args(false)  // FILE may follow
      ->check(channel());
  command->add_flag("--jsonl", arguments->is_jsonl, "one JSON object a line, for pipes")
      ->excludes(file);
  command->add_flag("--replace", arguments->replaces, "FILE may exist and is overwritten")
      ->needs(file);
  command->add_option("-C,--count", arguments->count, "end after so many messages")->check(count());
  command
      ->add_option("-W,--timeout", arguments->timeout_s,
                   "end after so many seconds; exit code 124 when -C was not reached")
      ->check(above_zero());
  command->callback([&common, &verb, arguments] {
    if (arguments->file.empty() && !arguments->is_jsonl) {
      throw CLI::RequiredError("FILE, or --jsonl for lines on standard output,");
    }
    verb = [&common, arguments] { return record(common, *arguments); };
  });
}

void add_play(CLI::App& app, const Common& common, Verb& verb) {
  auto arguments = std::make_shared<PlayArguments>();
  auto* command =
      app.add_subcommand("play", "Publish a recording's messages again, with the same spacing");
  command->add_option("FILE", arguments->file, "what `record` has written")->required();
  command->add_option("-c,--channels", arguments->channels, "only these; default: all")
      ->delimiter(',')
      ->allow_extra_args(false)  // FILE may follow
      ->check(channel());
  command->add_option("--rate", arguments->rate, "times the speed of the recording")
      ->check(above_zero())
      ->capture_default_str();
  command->add_flag("--loop", arguments->is_looping, "from the beginning again, until a signal");
  command->add_flag("--wait", arguments->waits,
                    "begin when another robot is heard, or a program here listens to a channel");
  command->add_option("--ttl", arguments->ttl, "hops after the first")
      ->check(ttl())
      ->capture_default_str();
  command->callback([&common, &verb, arguments] {
    verb = [&common, arguments] { return play(common, *arguments); };
  });
}

}  // namespace

void add_recording(CLI::App& app, const Common& common, Verb& verb) {
  add_record(app, common, verb);
  add_play(app, common, verb);
}

}  // namespace swarmtalk::cli
