// The keys of a link, and when it speaks for their sake.
#include "drivers/link/link_seal.hpp"

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <optional>

#include "tests/unit/drivers/test_link_user.hpp"

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;

std::shared_ptr<const frame::SwarmKey> some_key() {
  const std::array<std::uint8_t, frame::SwarmKey::kBytes> bytes{1, 2, 3};
  return std::make_shared<const frame::SwarmKey>(bytes);
}

class LinkSealTest : public testing::Test {
 protected:
  /// As a link does: the frame that is built says it.
  bool speak(MonotonicTime now) {
    ++spoken_;
    if (!can_leave_) return false;
    Bytes frame(1400);
    return builder_.build_beacon(user_, frame, frame.size(), now).size_bytes > 0;
  }

  boost::asio::io_context io_;
  TestLinkUser user_{1};
  FrameBuilder builder_{frame::ProfileId::kWifi, 1000};
  FrameReceiver receiver_{frame::ProfileId::kWifi};
  bool can_leave_ = true;
  int spoken_ = 0;
  std::optional<LinkSeal> seal_{std::in_place, io_, builder_, receiver_,
                                [this](MonotonicTime now) { return speak(now); }};
};

TEST_F(LinkSealTest, SealsWithTheKeyFromItsUseOn) {
  const auto key = some_key();
  seal_->set_key(key);
  EXPECT_TRUE(seal_->is_sealed());
  EXPECT_EQ(builder_.sealer(), nullptr);
  seal_->use(7);
  ASSERT_NE(builder_.sealer(), nullptr);
  EXPECT_EQ(&builder_.sealer()->key(), key.get());
  seal_->set_key(nullptr);
  seal_->use(7);
  EXPECT_FALSE(seal_->is_sealed());
  EXPECT_EQ(builder_.sealer(), nullptr);
}

TEST_F(LinkSealTest, SpeaksSoonAfterAKeyIsThereAndThenWaits) {
  seal_->set_key(some_key());
  seal_->use(7);
  EXPECT_TRUE(run_until(io_, [&] { return spoken_ == 1; }));
  run_for(io_, 150ms);
  EXPECT_EQ(spoken_, 1);
}

TEST_F(LinkSealTest, TriesAgainWhenNoFrameCanLeave) {
  can_leave_ = false;
  seal_->set_key(some_key());
  seal_->use(7);
  EXPECT_TRUE(run_until(io_, [&] { return spoken_ == 2; }));
  can_leave_ = true;
  EXPECT_TRUE(run_until(io_, [&] { return spoken_ == 3; }));
}

TEST_F(LinkSealTest, SaysThatFreshnessIsNotChecked) {
  EXPECT_EQ(seal_->remark(), "");
  seal_->set_key(some_key());
  EXPECT_EQ(seal_->remark(), "");
  seal_->set_freshness(false);
  EXPECT_EQ(seal_->remark(), ", sealed, freshness not checked");
  seal_->use(7);
  run_for(io_, 20ms);
  EXPECT_EQ(spoken_, 0) << "nobody has to be shown that we live";
}

TEST_F(LinkSealTest, MayBeGoneBeforeItSpeaks) {
  seal_->set_key(some_key());
  seal_->use(7);
  seal_.reset();
  run_for(io_, 20ms);
  EXPECT_EQ(spoken_, 0);
}

}  // namespace
}  // namespace swarmtalk::drivers
