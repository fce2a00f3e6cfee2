#include "usage/mistakes.hpp"

#include <algorithm>
#include <cctype>
#include <vector>

#include "text/nearest.hpp"

namespace swarmtalk::usage {
namespace {

using Path = std::vector<const CLI::App*>;  // a program, its subcommand, and that one's

bool is_long_option(const std::string& word) {
  return word.size() > 2 && word.starts_with("--");
}

std::string name_in(const std::string& word) {
  return word.substr(0, word.find('='));
}

/// Options of a program stand behind its subcommands as well.
const CLI::Option* option_of(const Path& path, const std::string& word) {
  for (const CLI::App* app : path) {
    if (const CLI::Option* option = app->get_option_no_throw(name_in(word))) return option;
  }
  return nullptr;
}

const CLI::App* subcommand_of(const CLI::App& app, const std::string& word) {
  const auto found =
      app.get_subcommands([&](const CLI::App* each) { return each->check_name(word); });
  return found.empty() ? nullptr : found.front();
}

std::vector<std::string> subcommands_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* each : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (!each->get_group().empty()) names.push_back(each->get_name());
  }
  return names;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  return text;
}

/// Names of the positional options as if they were options: --robots.
std::vector<std::string> options_of(const Path& path, bool positional) {
  std::vector<std::string> names;
  for (const CLI::App* app : path) {
    for (const CLI::Option* each : app->get_options({})) {
      if (positional && each->get_positional()) {
        names.push_back("--" + lower(each->get_name(true)));
      } else if (!positional && !each->get_group().empty()) {
        for (const std::string& name : each->get_lnames()) names.push_back("--" + name);
      }
    }
  }
  return names;
}

std::string unknown_option(const Path& path, const std::string& word) {
  const std::string name = name_in(word);
  std::string text = "there is no option '" + name + "'";
  if (const std::string near = text::nearest(name, options_of(path, false)); !near.empty()) {
    return text + "; did you mean '" + near + "'?";
  }
  const std::string place = text::nearest(name, options_of(path, true));
  if (place.empty()) return text;
  text += "; that is given without a name:";
  for (const CLI::App* app : path) text += " " + app->get_name();
  for (const CLI::Option* each : path.back()->get_options({})) {
    if (each->get_positional()) text += " " + each->get_name(true);
  }
  return text;
}

/// What the last subcommand of a line needs and has not got; empty: nothing that stands there
/// without a name.
std::string missing_argument(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App* command = &app;
  std::string name;
  while (!command->get_subcommands().empty()) {
    command = command->get_subcommands().front();
    name += (name.empty() ? "" : " ") + command->get_name();
  }
  for (const CLI::Option* each : command->get_options({})) {
    const std::string wanted = each->get_name(true);
    if (!each->get_positional() || !std::string(error.what()).starts_with(wanted + " ")) continue;
    std::string what = each->get_description();
    if (!what.empty()) what.replace(0, 1, lower(what.substr(0, 1)));
    return (name.empty() ? app.get_name() : name) + " needs " + wanted +
           (what.empty() ? "" : " (" + what + ")");
  }
  return {};
}

/// An option that stands before the subcommand whose it is; empty: none does.
std::string misplaced_option(const CLI::App& app, const std::vector<std::string>& words) {
  Path path{&app};
  std::vector<std::string> early;
  for (const std::string& word : words) {
    if (is_long_option(word)) {
      if (option_of(path, word) == nullptr) early.push_back(word);
    } else if (const CLI::App* next = subcommand_of(*path.back(), word)) {
      path.push_back(next);
      for (const std::string& each : early) {
        if (option_of({next}, each) == nullptr) continue;
        return name_in(each) + " goes after " + next->get_name();
      }
    }
  }
  return {};
}

/// The first word that is no name of anything; empty: there is none.
std::string unknown_word(const CLI::App& app, const std::vector<std::string>& words) {
  Path path{&app};
  std::string subcommand;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (word.starts_with('-')) {
      const CLI::Option* option = option_of(path, word);
      const bool has_value = option != nullptr && option->get_items_expected_min() > 0;
      if (has_value && word.find('=') == std::string::npos) ++i;
    } else if (const CLI::App* next = subcommand_of(*path.back(), word)) {
      path.push_back(next);
    } else if (subcommand.empty() && !subcommands_of(*path.back()).empty()) {
      subcommand = unknown_subcommand(*path.back(), word);
    }
  }
  for (const std::string& word : words) {
    if (is_long_option(word) && option_of(path, word) == nullptr) return unknown_option(path, word);
  }
  return subcommand;
}

}  // namespace

std::string unknown_subcommand(const CLI::App& app, const std::string& word) {
  const std::string near = text::nearest(word, subcommands_of(app));
  return "there is no subcommand '" + word + "'" +
         (near.empty() ? "" : "; did you mean '" + near + "'?");
}

std::string with_help(const std::string& sentence, const std::string& help) {
  return sentence + (sentence.ends_with('?') ? " See " : "; see ") + help;
}

std::string mistake(const CLI::App& app, const CLI::ParseError& error, int argc,
                    const char* const* argv) {
  const bool is_extra = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError);
  if (!is_extra && error.get_name() != "RequiredError") return error.what();
  std::vector<std::string> words;
  for (int i = 1; i < argc && std::string(argv[i]) != "--"; ++i) words.emplace_back(argv[i]);
  std::string text = misplaced_option(app, words);
  if (text.empty()) text = unknown_word(app, words);
  if (text.empty() && !is_extra) text = missing_argument(app, error);
  return text.empty() ? error.what() : text;
}

}  // namespace swarmtalk::usage
