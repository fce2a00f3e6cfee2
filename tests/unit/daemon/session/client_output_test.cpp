// What waits for one client, without a socket: the order and the limits.
#include "daemon/session/client_output.hpp"

#include <gtest/gtest.h>

#include <array>
#include <random>

namespace swarmtalk::daemon {
namespace {

class Output : public testing::Test {
 protected:
  void answer(std::uint32_t request_id) {
    ipc::Envelope envelope;
    envelope.set_request_id(request_id);
    envelope.mutable_done();
    output_.add_answer(envelope);
  }
  void deliver(QueuedSubscription& subscription, const std::string& payload) {
    output_.add_delivery(
        subscription,
        pool_.take({}, {reinterpret_cast<const std::uint8_t*>(payload.data()), payload.size()},
                   false));
  }
  /// What is written now: ids of answers, payloads of deliveries.
  std::vector<std::string> frames() {
    std::vector<std::string> read;
    for (const ipc::Envelope& envelope : envelopes()) {
      read.push_back(envelope.has_deliver() ? envelope.deliver().payload()
                                            : std::to_string(envelope.request_id()));
    }
    return read;
  }

  /// The only one that waits.
  ipc::Deliver next_delivery() {
    output_.refill();
    const std::vector<ipc::Envelope> waiting = envelopes();
    EXPECT_EQ(waiting.size(), 1u);
    output_.advance(output_.unwritten().size());
    return waiting.empty() ? ipc::Deliver() : waiting[0].deliver();
  }
  std::vector<ipc::Envelope> envelopes() const {
    ipc::FrameReader reader;
    const std::string_view bytes = output_.unwritten();
    const auto room = reader.prepare(bytes.size());
    std::copy(bytes.begin(), bytes.end(), room.begin());
    reader.commit(bytes.size());
    std::vector<ipc::Envelope> read;
    ipc::Envelope envelope;
    while (reader.next(envelope) == ipc::ReadResult::kEnvelope) read.push_back(envelope);
    return read;
  }

  MessagePool pool_;
  LimitsConfig limits_;
  DaemonCounters counters_;
  int wakes_ = 0;
  ClientOutput output_{limits_, counters_, [this] { ++wakes_; }};
  QueuedSubscription a_{8, false};
  QueuedSubscription b_{8, false};
};

TEST_F(Output, OfAnAnswerThatFitsNoFrameTheClientIsTold) {
  ipc::Envelope status;
  status.set_request_id(7);
  status.mutable_status()->set_version(std::string(ipc::kMaxEnvelopeBytes, 'x'));
  output_.add_answer(status);
  output_.refill();
  ASSERT_EQ(envelopes().size(), 1u);
  EXPECT_EQ(envelopes()[0].request_id(), 7u);
  EXPECT_EQ(envelopes()[0].failure().code(), ipc::ERROR_LIMIT);
  EXPECT_EQ(wakes_, 1);
}

TEST_F(Output, TellsOfAMessageAllThatIsKnownAndNothingElse) {
  MessageHead head;
  head.channel = 41;
  head.sender = 42;
  head.epoch = 43;
  head.number = 44;
  head.distance_m = 4.5f;
  head.bearing_rad = -0.5f;
  head.sender_pose = frame::FramePose::from_metres(1.5, -2.5, 0.75, 0.46);
  head.transmitter = 47;
  head.hops = 48;
  head.ttl = 49;
  head.buffering_delay_us = 50;
  head.received_at_ns = 51;
  head.crossed_gateway = true;
  head.origin = GatewayOrigin{.link = "air", .node = 52, .number = 53};
  a_.id = 54;
  a_.lost = Loss{55, 56, 57, 58};
  const std::array<std::uint8_t, 3> payload{0, 0x7F, 0xFF};
  output_.add_delivery(a_, pool_.take(head, payload, true));
  const ipc::Deliver all = next_delivery();
  EXPECT_EQ(all.subscription_id(), 54u);
  EXPECT_EQ(all.payload(), std::string("\x00\x7F\xFF", 3));
  EXPECT_EQ(all.channel(), 41u);
  EXPECT_EQ(all.sender(), 42u);
  EXPECT_EQ(all.epoch(), 43u);
  EXPECT_EQ(all.message_number(), 44u);
  EXPECT_EQ(all.distance_m(), 4.5f);
  EXPECT_EQ(all.bearing_rad(), -0.5f);
  EXPECT_EQ(all.sender_pose().x_m(), 1.5f);
  EXPECT_EQ(all.sender_pose().y_m(), -2.5f);
  EXPECT_NEAR(all.sender_pose().theta_rad(), 0.75f, 1e-4f);
  EXPECT_EQ(all.sender_pose().age_ms(), 460u);
  EXPECT_EQ(all.transmitter(), 47u);
  EXPECT_EQ(all.hops(), 48u);
  EXPECT_EQ(all.ttl(), 49u);
  EXPECT_EQ(all.buffering_delay_us(), 50u);
  EXPECT_EQ(all.received_at_ns(), 51u);
  EXPECT_TRUE(all.local());
  EXPECT_EQ(all.origin().link(), "air");
  EXPECT_EQ(all.origin().node(), 52u);
  EXPECT_EQ(all.origin().message_number(), 53u);
  EXPECT_EQ(all.lost_before().air(), 55u);
  EXPECT_EQ(all.lost_before().kernel(), 56u);
  EXPECT_EQ(all.lost_before().daemon(), 57u);
  EXPECT_EQ(all.lost_before().late(), 58u);

  MessageHead bare;
  bare.sender_pose = frame::FramePose::stale();
  bare.is_time_known = false;
  output_.add_delivery(a_, pool_.take(bare, {}, false));
  const ipc::Deliver nothing = next_delivery();
  EXPECT_FALSE(nothing.has_distance_m() || nothing.has_bearing_rad() || nothing.has_sender_pose() ||
               nothing.has_buffering_delay_us() || nothing.has_received_at_ns() ||
               nothing.local() || nothing.has_origin() || nothing.has_lost_before());

  bare.crossed_gateway = true;
  output_.add_delivery(a_, pool_.take(bare, {}, false));
  const ipc::Deliver crossed = next_delivery();
  EXPECT_TRUE(crossed.has_origin()) << "it crossed, from where is not known";
  EXPECT_FALSE(crossed.origin().has_link());
}

TEST_F(Output, TakesAnswersFirstAndSubscriptionsInTurn) {
  deliver(a_, "a1");
  deliver(a_, "a2");
  deliver(b_, "b1");
  answer(7);
  EXPECT_EQ(wakes_, 3);  // a2 goes with a1
  ASSERT_TRUE(output_.refill());
  EXPECT_EQ(frames(), (std::vector<std::string>{"7", "a1", "b1", "a2"}));
  EXPECT_EQ(output_.deliveries_sent(), 3u);
  output_.advance(output_.unwritten().size());
  EXPECT_TRUE(output_.is_empty());
  EXPECT_FALSE(output_.refill());
}

TEST_F(Output, PutsAnAnswerBehindTheFrameThatHasBeenBegun) {
  deliver(a_, "a1");
  deliver(a_, "a2");
  ASSERT_TRUE(output_.refill());
  output_.advance(1);
  answer(7);
  output_.put_answers_ahead();
  const std::size_t first = output_.unwritten().size();
  EXPECT_EQ(output_.answer_bytes(), 0u);
  output_.advance(first);
  EXPECT_TRUE(output_.is_empty());
  EXPECT_EQ(output_.waiting_bytes(), 0u);
}

TEST_F(Output, PutsAnAnswerAheadOfDeliveriesNotYetBegun) {
  answer(1);
  deliver(a_, "a1");
  ASSERT_TRUE(output_.refill());
  answer(2);
  output_.put_answers_ahead();
  answer(3);
  output_.put_answers_ahead();
  EXPECT_EQ(frames(), (std::vector<std::string>{"1", "2", "3", "a1"}));
}

TEST_F(Output, DropsTheOldestOfASubscriptionWhenTheClientHasTooManyBytes) {
  limits_.queue_bytes = 4;
  deliver(a_, "aa");
  deliver(a_, "bb");
  deliver(a_, "cc");
  deliver(a_, "ddddd");
  EXPECT_EQ(output_.lost(), 4u);
  EXPECT_EQ(counters_.deliveries_dropped_bytes, 4u);
  EXPECT_EQ(output_.waiting_bytes(), 0u);
}

TEST_F(Output, MessagesOfNoBytesAreLimitedToo) {
  limits_.queue_bytes = 512 * 100;
  QueuedSubscription large{100'000, false};
  for (int i = 0; i < 10'000; ++i) deliver(large, "");
  EXPECT_EQ(large.queue.size(), 100u);
  EXPECT_EQ(counters_.deliveries_dropped_bytes, 9'900u);
  output_.forget(large);
  for (int i = 0; i < 8; ++i) deliver(a_, "a");
  EXPECT_EQ(output_.lost(), 9'900u) << "their room is free again";
}

/// Lost before it came here, dropped here by any rule, or delivered: each message is one of these,
/// and each loss is told once.
TEST_F(Output, TellsEachLossOnceInWhateverOrderThingsHappen) {
  std::mt19937 random(5);
  const auto draw = [&](unsigned below) { return static_cast<unsigned>(random() % below); };
  for (const std::uint32_t queue_bytes : {3, 1000}) {
    limits_.queue_bytes = queue_bytes;
    for (const auto& [keep_last, latest_of_each] :
         {std::pair<std::size_t, bool>{1, false}, {8, false}, {3, true}}) {
      QueuedSubscription sut{keep_last, latest_of_each};
      Loss before, told;
      std::uint64_t came = 0, delivered = 0;
      const auto come = [&] {
        MessageHead head;
        head.sender = static_cast<std::uint16_t>(draw(3));
        const std::vector<std::uint8_t> payload(draw(3), 'x');
        output_.add_delivery(sut, pool_.take(head, payload, false));
        ++came;
      };
      const auto read = [&] {
        while (output_.refill()) {
          ipc::FrameReader reader;
          const std::string_view bytes = output_.unwritten();
          const auto room = reader.prepare(bytes.size());
          std::copy(bytes.begin(), bytes.end(), room.begin());
          reader.commit(bytes.size());
          ipc::Envelope envelope;
          while (reader.next(envelope) == ipc::ReadResult::kEnvelope) {
            const ipc::LostBefore& lost = envelope.deliver().lost_before();
            told += Loss{lost.air(), lost.kernel(), lost.daemon(), lost.late()};
            ++delivered;
          }
          output_.advance(bytes.size());
        }
      };
      for (int step = 0; step < 2000; ++step) {
        const unsigned chance = draw(10);
        if (chance < 3) {
          const Loss lost{draw(3), draw(2), 0, draw(2)};
          sut.lost += lost;
          before += lost;
        } else if (chance < 8) {
          come();
        } else {
          read();
        }
      }
      read();
      come();  // tells what is left
      read();
      EXPECT_GT(delivered, 100u);
      EXPECT_EQ(told.air, before.air);
      EXPECT_EQ(told.kernel, before.kernel);
      EXPECT_EQ(told.late, before.late);
      EXPECT_EQ(told.daemon, came - delivered);
      EXPECT_GT(told.daemon, 0u);
    }
  }
}

/// What a client that reads has taken, again and again, does not fill its queue.
TEST_F(Output, HasRoomAgainForEachMessageThatWasTakenDroppedOrForgotten) {
  limits_.queue_bytes = 512 * 20;
  QueuedSubscription kept{3, false};
  QueuedSubscription latest{100, true};
  QueuedSubscription old{100, false};
  old.max_age_ms = 1;  // these messages were received when the clock began
  for (int i = 0; i < 200; ++i) {
    QueuedSubscription left{8, false};
    deliver(left, "left");
    output_.forget(left);
    for (int k = 0; k < 4; ++k) {
      deliver(kept, "k");
      deliver(latest, "l");
      deliver(old, "");
      deliver(a_, "a");
    }
    while (output_.refill()) output_.advance(output_.unwritten().size());
  }
  EXPECT_EQ(counters_.deliveries_dropped_bytes, 0u);
  EXPECT_EQ(counters_.deliveries_dropped_old, 800u);
  EXPECT_EQ(counters_.deliveries_dropped_closed, 200u);
  EXPECT_EQ(output_.deliveries_sent(), 200u * (3 + 1 + 4));
}

TEST_F(Output, IsFullOfAnswersUntilTheyAreWritten) {
  limits_.reply_bytes = 10;
  EXPECT_FALSE(output_.is_full());
  for (std::uint32_t i = 1; i <= 5; ++i) answer(i);
  EXPECT_TRUE(output_.is_full());
  ASSERT_TRUE(output_.refill());
  EXPECT_FALSE(output_.is_full());
  for (std::uint32_t i = 1; i <= 5; ++i) answer(i);
  output_.close();
  EXPECT_FALSE(output_.is_full()) << "nobody will read them";
}

TEST_F(Output, ForgetsASubscriptionWithWhatItHasQueued) {
  deliver(a_, "a1");
  deliver(b_, "b1");
  output_.forget(a_);
  ASSERT_TRUE(output_.refill());
  EXPECT_EQ(frames(), std::vector<std::string>{"b1"});
  EXPECT_EQ(counters_.deliveries_dropped_closed, 1u);
}

TEST_F(Output, TakesNothingOnceItIsClosed) {
  output_.close();
  answer(1);
  EXPECT_EQ(wakes_, 0);
  EXPECT_FALSE(output_.refill());
}

}  // namespace
}  // namespace swarmtalk::daemon
