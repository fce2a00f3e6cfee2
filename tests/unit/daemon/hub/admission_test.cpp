// What is refused before it is taken on, by each cause.
#include "daemon/hub/admission.hpp"

#include <gtest/gtest.h>

#include "daemon/hub/publication.hpp"
#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

class AdmissionAlone : public testing::Test {
 protected:
  AdmissionAlone() {
    stations_.add(station_);
    publisher_.client = &client_;
    std::string held_name;
    EXPECT_FALSE(registry_.use({"", 1, std::nullopt}, held_name, channel_));
  }
  std::optional<ipc::ErrorCode> refused(std::size_t size_bytes, std::uint32_t ttl = 1,
                                        std::uint32_t waiting = 0) {
    const auto refusal = admission_.admit(publisher_, *channel_, size_bytes, ttl, {waiting, 0});
    return refusal ? std::optional(refusal->code) : std::nullopt;
  }

  DeafUser user_;
  FakeStation station_{user_};
  StationList stations_;
  ChannelTable names_{{}};
  ChannelRegistry registry_{names_, stations_};
  LimitsConfig limits_;
  DaemonCounters counters_;
  Shares shares_{limits_};
  Admission admission_{stations_, registry_, names_, shares_, counters_};
  FakeClient client_;
  Publisher publisher_;
  Channel* channel_ = nullptr;
};

TEST_F(AdmissionAlone, LetsAMessageWithinAllLimitsIn) {
  EXPECT_FALSE(refused(1000, 15, limits_.waiting_messages - 1));
}

TEST_F(AdmissionAlone, NamesWhatIsTooMuch) {
  EXPECT_EQ(refused(1001), ipc::ERROR_TOO_LONG);
  EXPECT_EQ(refused(1, 16), ipc::ERROR_BAD_TTL);
  EXPECT_EQ(refused(1, 1, limits_.waiting_messages), ipc::ERROR_LIMIT);
}

TEST_F(AdmissionAlone, TellsASmallMtuFromALinkThatIsDown) {
  station_.fits = 10;
  EXPECT_EQ(refused(11), ipc::ERROR_TOO_LONG);
  EXPECT_EQ(counters_.messages_over_mtu, 1u);
  station_.set_up(false);
  EXPECT_EQ(refused(11), ipc::ERROR_LINK_DOWN);
  EXPECT_EQ(counters_.messages_link_down, 1u);
}

TEST_F(AdmissionAlone, SharesThePaceOfAReservedChannelAmongAllPrograms) {
  std::string held_name;
  ASSERT_FALSE(registry_.use({"debug", std::nullopt, std::nullopt}, held_name, channel_));
  admission_.set_reserved({}, "robot.toml");
  EXPECT_EQ(refused(1), ipc::ERROR_BAD_CHANNEL);
  ReservedConfig on;
  on.debug = true;
  on.rate_hz = 1;
  on.burst = 2;
  admission_.set_reserved(on, "robot.toml");
  EXPECT_FALSE(admission_.check_reserved(channel_->number));
  EXPECT_FALSE(refused(1));
  EXPECT_FALSE(refused(1));
  EXPECT_EQ(refused(1), ipc::ERROR_RATE);
}

TEST_F(AdmissionAlone, SaysWhereAMessageOfNoBytesIsImpossible) {
  channel_->limits.least_message_bytes = 1;
  const auto refusal = admission_.admit(publisher_, *channel_, 0, 1, {});
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->code, ipc::ERROR_TOO_LONG);
  EXPECT_NE(refusal->text.find("send at least 1 byte"), std::string::npos);
  EXPECT_FALSE(refused(1));
}

TEST_F(AdmissionAlone, LetsAFullQueueHaveItsOldestDropped) {
  Publication waiting;
  publisher_.in_flight = &waiting;
  EXPECT_EQ(refused(1), ipc::ERROR_BUSY) << "it has no queue";
  publisher_.queue_limit = 2;
  publisher_.queue = {&waiting};
  EXPECT_FALSE(refused(1));
  publisher_.queue = {&waiting, &waiting};
  EXPECT_EQ(refused(1), ipc::ERROR_BUSY);
  EXPECT_EQ(counters_.messages_busy, 2u);
  publisher_.drops_oldest = true;
  EXPECT_FALSE(refused(1));
  EXPECT_EQ(counters_.messages_busy, 2u);
}

}  // namespace
}  // namespace swarmtalk::daemon
