// Text of strangers (from the air, from other programs) made fit to be shown: on a terminal, in a
// log line, in a metrics file, in JSON. No character of it may steer a terminal, change the
// direction of what stands beside it, or be invisible. Pure functions, used by daemon and CLI.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace swarmtalk::text {

/// Whether a character shows as itself and leaves the rest of the line alone. Not plain are:
/// control characters (C0, DEL, C1), the marks, embeddings, overrides and isolates that change
/// direction, line and paragraph separators, and characters of no width, joiners included: with
/// them two names could look the same.
bool is_plain(std::uint32_t code_point);

/// Well-formed UTF-8, and every character plain.
bool is_plain_text(std::string_view bytes);

/// `bytes` with everything else escaped: \n, \t, \r; other characters as \u009b, which inside a
/// string of JSON is its escape as well; bytes that are not UTF-8 as \xff. A backslash stays.
std::string plain(std::string_view bytes);

/// The same with each backslash as two, so that it can be read back.
std::string escaped(std::string_view bytes);

/// plain() for text of several lines: newlines stay.
std::string plain_lines(std::string_view bytes);

/// Plain, in quotes, with `quote` and backslash escaped inside: a name cannot end its own quotes.
std::string quoted(std::string_view name, char quote = '\'');

/// A name among other words: itself if it is made of letters, digits and -_./:+@ or of characters
/// beyond ASCII; else in double quotes, so that it cannot be taken for the words beside it.
std::string shown_name(std::string_view name);

/// A word of a command that somebody is to type: the shell takes it as one, whatever is in it.
std::string shell_word(std::string_view word);

}  // namespace swarmtalk::text
