// How the text is stored that people hand us: editors and shells of other systems put a mark before
// UTF-8, write UTF-16, and end lines with a carriage return as well. Pure functions; every reader
// of a text file or of piped lines uses them.
#pragma once

#include <string>
#include <string_view>

namespace swarmtalk::text {

/// "is UTF-16; save it as UTF-8", or of UTF-32, to go after a file's name; empty for all other
/// text, which may still be none.
/// @param text  a file's beginning, 4 bytes or more: a mark there, or zeros as Latin letters have
std::string encoding_problem(std::string_view text);

/// Without the mark that UTF-8 may begin with.
std::string_view without_mark(std::string_view text);

/// A line without the carriage return that Windows puts before its line feed.
std::string_view without_return(std::string_view line);

/// What is wrong with lines that end with a carriage return alone, which are one line here; to go
/// after a comma or "it". Empty: there is none.
std::string bare_return_problem(std::string_view line);

}  // namespace swarmtalk::text
