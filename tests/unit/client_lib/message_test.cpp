#include <gtest/gtest.h>

#include <swarmtalk/client.hpp>

#include <array>
#include <concepts>
#include <span>
#include <vector>

namespace swarmtalk {
namespace {

// What send() accepts is decided at compile time.
template <typename T>
concept Sendable = requires(Publisher publisher, T value) {
  { publisher.send(value) } -> std::same_as<Status>;
};
struct Plain {
  int number;
};
struct Rich {
  std::string text;
};
static_assert(Sendable<const char*> && Sendable<std::string> && Sendable<std::string_view>);
static_assert(Sendable<std::vector<std::uint8_t>> && Sendable<std::span<std::uint8_t>>);
static_assert(Sendable<Plain> && Sendable<int> && Sendable<std::array<float, 3>>);
static_assert(!Sendable<Rich> && !Sendable<Plain*>);

TEST(Message, AsRefusesAnotherSize) {
  Message message;
  message.payload = std::string("\x01\x00\x00\x00", 4);
  EXPECT_EQ(message.as<std::int32_t>(), 1);
  EXPECT_FALSE(message.as<std::int64_t>());
  EXPECT_FALSE(message.as<std::int16_t>());
}

TEST(Message, UnknownDistanceComparesFalse) {
  const Message message;
  EXPECT_FALSE(message.has_distance());
  EXPECT_FALSE(message.distance_m < 1.0F);
  EXPECT_FALSE(message.distance_m >= 1.0F);
}

TEST(Status, EveryCodeHasASentence) {
  for (int code = 0; code <= static_cast<int>(StatusCode::kSystem); ++code) {
    EXPECT_NE(Status(static_cast<StatusCode>(code)).text(), "unknown error") << code;
  }
}

TEST(Publisher, AMovedFromHandleSaysSo) {
  Publisher publisher;
  EXPECT_EQ(publisher.send("x").code(), StatusCode::kBadArgument);
  EXPECT_FALSE(publisher.busy());
}

}  // namespace
}  // namespace swarmtalk
