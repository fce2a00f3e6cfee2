// Which thread is inside.
#include "client_lib/turn.hpp"

#include <gtest/gtest.h>

#include <functional>

namespace swarmtalk::client {
namespace {

void in_another_thread(const std::function<void()>& task) {
  std::thread(task).join();
}

TEST(Turn, LetsOneThreadInAtATime) {
  Turn turn;
  {
    const Turn::Stay stay(turn);
    EXPECT_TRUE(stay.is_first());
    EXPECT_TRUE(turn.is_mine());
    in_another_thread([&] {
      const Turn::Stay other(turn);
      EXPECT_TRUE(other.is_refused());
      EXPECT_FALSE(other.is_first());
      EXPECT_FALSE(turn.is_mine());
    });
    const Turn::Stay nested(turn);
    EXPECT_FALSE(nested.is_first());
    EXPECT_FALSE(nested.is_refused());
  }
  EXPECT_FALSE(turn.is_mine());
  in_another_thread([&] { EXPECT_TRUE(Turn::Stay(turn).is_first()); });
}

TEST(Turn, KnowsWhoWasInsideLast) {
  Turn turn;
  EXPECT_FALSE(turn.is_owner());
  { const Turn::Stay stay(turn); }
  EXPECT_TRUE(turn.is_owner());
  in_another_thread([&] {
    EXPECT_FALSE(turn.is_owner());
    const Turn::Stay stay(turn);
    EXPECT_TRUE(turn.is_owner());
  });
  EXPECT_FALSE(turn.is_owner()) << "it was handed over";
}

TEST(Turn, TellsOnceThatAThreadComesBackAfterAnother) {
  Turn turn;
  int told = 0;
  const auto call = [&] { told += turn.is_called_in_turn() ? 1 : 0; };
  call();
  call();
  // The second thread lives until the end: the number of one that is gone may be used again.
  in_another_thread([&] {
    call();
    in_another_thread(call);
    EXPECT_EQ(told, 0) << "handed over twice";
    call();
    EXPECT_EQ(told, 1);
    in_another_thread(call);
    call();
    EXPECT_EQ(told, 1) << "only once";
  });
}

}  // namespace
}  // namespace swarmtalk::client
