// What is wrong with a command line, in words: with the nearest name where one is misspelt, which
// CLI11 does not tell. For main().
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace swarmtalk::usage {

/// @param error  of app.parse(argc, argv)
/// @return one sentence, without a full stop
std::string mistake(const CLI::App& app, const CLI::ParseError& error, int argc,
                    const char* const* argv);

/// The sentence, and where more is said: "...; see PROGRAM --help", after a question "See ...".
/// @param help  the command that prints it
std::string with_help(const std::string& sentence, const std::string& help);

/// @return "there is no subcommand 'sbu'; did you mean 'sub'?"
std::string unknown_subcommand(const CLI::App& app, const std::string& word);

}  // namespace swarmtalk::usage
