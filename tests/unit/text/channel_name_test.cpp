#include "text/channel_name.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::text {
namespace {

TEST(ChannelName, GivesTheNumberThatTheDocumentSays) {
  EXPECT_EQ(hashed_channel("hello"), 58164);
  EXPECT_EQ(hashed_channel("alarm"), 62769);
  EXPECT_EQ(hashed_channel("a"), 0x8000 | ((0xE40C292Cu >> 16 ^ 0xE40C292Cu) & 0x7FFF));
}

}  // namespace
}  // namespace swarmtalk::text
