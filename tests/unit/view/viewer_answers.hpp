// What a viewer has said, taken out of its queue.
#pragma once

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "view/viewer.hpp"

namespace swarmtalk::view {

using Json = nlohmann::json;

inline std::vector<Outgoing> all_of(Viewer& viewer) {
  std::vector<Outgoing> said;
  while (auto each = viewer.queue.take()) said.push_back(*each);
  return said;
}

/// Texts alone are expected.
inline std::vector<Json> texts_of(Viewer& viewer) {
  std::vector<Json> said;
  for (const Outgoing& each : all_of(viewer)) {
    EXPECT_FALSE(each.is_binary);
    said.push_back(Json::parse(*each.bytes));
  }
  return said;
}

}  // namespace swarmtalk::view
