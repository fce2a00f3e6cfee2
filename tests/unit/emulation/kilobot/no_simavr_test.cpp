#include <gtest/gtest.h>

TEST(KilobotEmulation, NeedsSimavr) {
  GTEST_SKIP() << "libsimavr is missing (Debian: libsimavr-dev), kilobot-emulator was not built";
}
