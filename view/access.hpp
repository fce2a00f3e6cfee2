// Who may look: a decision about one request from its peer and its headers. Guards against other
// machines (token), against foreign pages that are open in the same browser (Origin) and against
// names that were made to point here (Host). Pure functions; anything may come in.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace swarmtalk::view {

struct AccessRules {
  std::uint16_t port = 0;
  std::string token;                         // empty: nobody but this machine is let in
  std::vector<std::string> allowed_origins;  // besides our own page's: "http://lab:8081"
};

struct Visitor {
  bool is_this_machine = false;            // by the address of its socket
  std::string_view host;                   // header Host
  std::optional<std::string_view> origin;  // header Origin; none: it is not a page
  std::string_view target;                 // "/?token=abc"
  std::string_view authorization;
};

/// @return empty: it may; else one sentence that says why not and what to do
std::string refusal(const AccessRules& rules, const Visitor& visitor);

/// The value of a parameter of the target's query; empty: there is none.
std::string_view query_value(std::string_view target, std::string_view name);

/// The token that a file holds in its first line; a mark and a carriage return are no part of it.
/// @param path  the file's, for the error
/// @throws std::runtime_error  one sentence: why there is none
std::string token_of(std::string_view text, const std::string& path);

/// Whether the texts are equal, in a time that does not tell where they differ.
bool is_equal_secret(std::string_view one, std::string_view other);

}  // namespace swarmtalk::view
