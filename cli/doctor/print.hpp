// A doctor's report as lines for people and as JSON (docs/cli-json.md).
#pragma once

#include <string>

#include "cli/doctor/facts.hpp"
#include "cli/doctor/finding.hpp"
#include "cli/doctor/peer.hpp"
#include "cli/text/format.hpp"

namespace swarmtalk::cli::doctor {

/// What --fix did about a finding.
struct Fixed {
  bool is_tried = false;
  std::string failure;  // empty: done
};

std::string to_text(const Report& report, const std::vector<Fixed>& fixes, const Look& look);
/// @param peer  null: it was not tested
Json to_json(const Report& report, const std::vector<Fixed>& fixes, const Facts& facts,
             const PeerFacts* peer);

}  // namespace swarmtalk::cli::doctor
