// The page, compiled in from view/page/index.html.
#pragma once

#include <string_view>

namespace swarmtalk::view {

std::string_view page();

}  // namespace swarmtalk::view
