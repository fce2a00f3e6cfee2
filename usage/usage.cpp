#include "usage/usage.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <memory>

#include "usage/mistakes.hpp"
#include "usage/terminal.hpp"

namespace swarmtalk::usage {
namespace {

constexpr std::size_t kUsualColumns = 80;
constexpr std::size_t kNarrow = 72;  // then descriptions begin on a line of their own

// Reading or writing there goes on to fail.
void occupy_standard_streams() {
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(fd, F_GETFD) != -1) continue;
    ::open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY);  // the lowest that is free
  }
}

std::size_t help_columns() {
  const std::size_t told = columns(STDOUT_FILENO);
  return told == 0 ? kUsualColumns : std::min<std::size_t>(told, 100);
}

class Formatter : public CLI::Formatter {
 public:
  Formatter() { column_width(help_columns() < kNarrow ? 4 : 30); }
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override {
    return wrapped(CLI::Formatter::make_help(app, std::move(name), mode), help_columns());
  }
};

}  // namespace

void prepare(CLI::App& app, const std::string& version) {
  occupy_standard_streams();
  app.formatter(std::make_shared<Formatter>());
  app.set_version_flag("-V,--version", version);
  app.add_flag_callback("--describe",
                        [&app] {
                          std::printf("%s\n", describe(app).c_str());
                          throw CLI::Success();
                        })
      ->group("");  // hidden
}

void add_help_command(CLI::App& app) {
  auto* help = app.add_subcommand("help", "Print the help of the program, or of a command");
  auto words = std::make_shared<std::vector<std::string>>();
  help->add_option("COMMAND", *words, "as in: help sub");
  help->callback([&app, words] {
    const CLI::App* command = &app;
    std::string name = app.get_name();
    for (const std::string& word : *words) {
      try {
        command = command->get_subcommand(word);
      } catch (const CLI::OptionNotFound&) {
        throw CLI::ValidationError(unknown_subcommand(*command, word));
      }
      name += " " + command->get_name();
    }
    const auto formatter = command->get_formatter();
    std::printf("%s", formatter->make_help(command, name, CLI::AppFormatMode::Normal).c_str());
    throw CLI::Success();
  });
}

}  // namespace swarmtalk::usage
