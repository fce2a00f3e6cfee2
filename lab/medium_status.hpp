// What a radio medium says of itself, as text for people.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace swarmtalk::lab {

/// Several lines. @param status  the medium's answer to "status" (lab/radio/radio_control.hpp)
std::string medium_status_text(const nlohmann::json& status);

}  // namespace swarmtalk::lab
