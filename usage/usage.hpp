// What the command lines of all our programs have in common: help that fits the terminal, `-V`, the
// verb `help`, and a hidden option from which manual pages and completions are made
// (tools/make_pages.py).
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace swarmtalk::usage {

/// Called once, before the subcommands are added and anything is opened: where descriptors 0 to 2
/// are closed, /dev/null takes their place, so that what is printed cannot go into a socket.
/// @param version  what --version prints
void prepare(CLI::App& app, const std::string& version);

/// `help [COMMAND...]`: the same as COMMAND --help. Called behind the other subcommands.
void add_help_command(CLI::App& app);

/// The options and subcommands of a program, as JSON for tools/make_pages.py.
std::string describe(const CLI::App& app);

}  // namespace swarmtalk::usage
