#include "view/access.hpp"

#include <sodium/utils.h>

#include <algorithm>
#include <cctype>
#include <stdexcept>

#include "text/encoding.hpp"

namespace swarmtalk::view {
namespace {

constexpr std::string_view kBearer = "Bearer ";
constexpr std::size_t kLeastTokenBytes = 8;

bool is_local_name(std::string_view name) {
  return name == "localhost" || name == "127.0.0.1" || name == "[::1]";
}

/// This machine, or the one of somebody who looks through a forwarded port, which may have another
/// number there. The page of another server has another origin than the host that it asks.
bool is_local_host(std::string_view host) {
  const auto colon = host.rfind(':');
  if (colon == std::string_view::npos || host.ends_with(']')) return is_local_name(host);
  const std::string_view port = host.substr(colon + 1);
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  return !port.empty() && std::all_of(port.begin(), port.end(), is_digit) &&
         is_local_name(host.substr(0, colon));
}

bool has_token(const AccessRules& rules, const Visitor& visitor) {
  if (rules.token.empty()) return false;
  if (is_equal_secret(query_value(visitor.target, "token"), rules.token)) return true;
  return visitor.authorization.starts_with(kBearer) &&
         is_equal_secret(visitor.authorization.substr(kBearer.size()), rules.token);
}

bool is_origin_good(const AccessRules& rules, const Visitor& visitor) {
  if (!visitor.origin || *visitor.origin == "http://" + std::string(visitor.host)) return true;
  const auto& allowed = rules.allowed_origins;
  return std::find(allowed.begin(), allowed.end(), *visitor.origin) != allowed.end();
}

}  // namespace

std::string token_of(std::string_view text, const std::string& path) {
  if (const std::string problem = text::encoding_problem(text); !problem.empty()) {
    throw std::runtime_error(path + " " + problem);
  }
  text = text::without_mark(text);
  if (text.empty()) {
    throw std::runtime_error("cannot read a token from " + path +
                             ": write one into its first line");
  }
  const std::string_view token = text::without_return(text.substr(0, text.find('\n')));
  const auto is_good = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_' || c == '.';
  };
  if (token.size() < kLeastTokenBytes || !std::all_of(token.begin(), token.end(), is_good)) {
    throw std::runtime_error("the token in " + path + " must have at least " +
                             std::to_string(kLeastTokenBytes) +
                             " characters, of letters, digits and - _ . only");
  }
  return std::string(token);
}

bool is_equal_secret(std::string_view one, std::string_view other) {
  return one.size() == other.size() && sodium_memcmp(one.data(), other.data(), one.size()) == 0;
}

std::string_view query_value(std::string_view target, std::string_view name) {
  const auto question = target.find('?');
  if (question == std::string_view::npos) return {};
  std::string_view rest = target.substr(question + 1);
  while (!rest.empty()) {
    const auto end = rest.find('&');
    const std::string_view pair = rest.substr(0, end);
    const auto equal = pair.find('=');
    if (equal != std::string_view::npos && pair.substr(0, equal) == name) {
      return pair.substr(equal + 1);
    }
    if (end == std::string_view::npos) break;
    rest.remove_prefix(end + 1);
  }
  return {};
}

std::string refusal(const AccessRules& rules, const Visitor& visitor) {
  const bool is_known = has_token(rules, visitor);
  if (!visitor.is_this_machine && !is_known) {
    return "a token is needed from another machine: open the address that swarmtalk-view printed";
  }
  if (!is_known && !is_local_host(visitor.host)) {
    return "the address must name this machine: open http://localhost:" +
           std::to_string(rules.port) + "/";
  }
  if (!is_origin_good(rules, visitor)) {
    return "a page from elsewhere may not look: start swarmtalk-view with --allow-origin and the "
           "page's origin";
  }
  return {};
}

}  // namespace swarmtalk::view
