// What words of the command line may be: those of all our programs, by the names that verbs use.
#pragma once

#include <cstdint>

#include "usage/checks.hpp"

namespace swarmtalk::cli {

using usage::above_zero;
using usage::any_number;
using usage::between;
using usage::channel;
using usage::is_digits;
using usage::not_empty;
using usage::whole_number;

/// How often something is done before the end: 1 or more.
inline CLI::Validator count() {
  return whole_number(UINT64_MAX, 1);
}
/// Hops after the first.
inline CLI::Validator ttl() {
  return whole_number(255);
}
inline CLI::Validator node_id() {
  return whole_number(65534, 1);
}
/// Seconds between two looks or reports: shorter, and a screen or pipe is all that is served.
inline CLI::Validator period() {
  return between(0.01, 1e6);
}

}  // namespace swarmtalk::cli
