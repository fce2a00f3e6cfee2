// What --fix can set with the caller's rights. The daemon sets nothing.
#pragma once

#include <functional>
#include <string>

#include "cli/doctor/facts.hpp"
#include "cli/doctor/finding.hpp"
#include "nl80211/asker.hpp"

namespace swarmtalk::cli::doctor {

/// Gives each finding that can be repaired from here its `fix`. All references must outlive it.
/// @param reload  lets the daemon read its configuration again; as Finding::fix
/// @param asker   null: no 802.11
void add_fixes(const Facts& facts, const Expected& expected,
               const std::function<std::string()>& reload, nl80211::Asker* asker, Report& report);

}  // namespace swarmtalk::cli::doctor
