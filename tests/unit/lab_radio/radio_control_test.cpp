// Requests to the medium of a lab, good and bad: it has an answer to each.
#include "lab/radio/radio_control.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace swarmtalk::lab::radio {
namespace {

using nlohmann::json;

class RadioControl : public testing::Test {
 protected:
  RadioControl() {
    air_.add(0, 0);
    air_.add(1000, 0);
  }

  json ask(const std::string& request) {
    return json::parse(answer(air_, {{"lost", json::object()}}, request));
  }

  sim::WifiAir air_{{},
                    1,
                    {[](uint32_t, uint32_t, std::span<const uint8_t>) { return true; },
                     [](uint32_t, uint64_t) {}}};
};

TEST_F(RadioControl, DoesWhatItIsTold) {
  EXPECT_EQ(ask(R"({"do": "move", "robot": 2, "x_m": 3, "y_m": 4})"), json::object());
  EXPECT_EQ(ask(R"({"do": "status"})")["robots"][1]["x_m"], 3);
}

TEST_F(RadioControl, BytesThatAreNotTextAreAnswered) {
  for (const std::string request : {"\xff", "{\"do\": \"\xff\xfe\"}", "\xc3", "", "[", "null",
                                    "{\"do\": \"caf\xc3\xa9\"}", "{\"do\": 7}", "\x1b[2J"}) {
    EXPECT_TRUE(ask(request).contains("error")) << request;
  }
}

TEST_F(RadioControl, EveryDamagedRequestIsAnswered) {
  std::mt19937 draws(1);
  const std::string whole = R"({"do": "link", "from": 1, "to": 2, "loss": 0.5})";
  for (int i = 0; i < 3'000; ++i) {
    std::string request = whole;
    for (unsigned flips = draws() % 4; flips > 0; --flips) {
      request[draws() % request.size()] = static_cast<char>(draws());
    }
    request.resize(draws() % 8 == 0 ? draws() % request.size() : request.size());
    EXPECT_TRUE(ask(request).is_object());
  }
}

TEST_F(RadioControl, JammersAndLinesHaveALimit) {
  for (std::size_t i = 0; i < kMostFaults; ++i) {
    const bool is_line = i % 2 == 0;
    EXPECT_FALSE(ask(is_line ? R"({"do": "part", "x_m": 3})"
                             : R"({"do": "jam", "x_m": 1, "y_m": 1, "radius_m": 2})")
                     .contains("error"));
  }
  EXPECT_TRUE(ask(R"({"do": "jam", "x_m": 1, "y_m": 1, "radius_m": 2})").contains("error"));
  EXPECT_TRUE(ask(R"({"do": "part", "x_m": 3})").contains("error"));
  ask(R"({"do": "unjam"})");
  EXPECT_FALSE(ask(R"({"do": "part", "x_m": 3})").contains("error"));
}

}  // namespace
}  // namespace swarmtalk::lab::radio
