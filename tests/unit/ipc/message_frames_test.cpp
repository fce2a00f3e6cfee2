#include "ipc/message_frames.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "ipc/framing.hpp"

namespace swarmtalk::ipc {
namespace {

constexpr int kRandomFrames = 2000;

template <class Frame>
std::string bytes_of(const Frame& frame) {
  std::string bytes;
  EXPECT_TRUE(append_frame(frame, bytes));
  return bytes;
}

/// Without the length in front.
template <class Frame>
std::string envelope_of(const Frame& frame) {
  return bytes_of(frame).substr(kLengthBytes);
}

/// Numbers of all lengths below 2^63, 0 among them.
class Random {
 public:
  explicit Random(std::uint64_t seed) : bits_(seed) {}
  bool coin() { return bits_() % 2 == 0; }
  std::uint64_t number64() { return bits_() % 8 == 0 ? 0 : bits_() >> (1 + bits_() % 63); }
  std::uint32_t number32() { return static_cast<std::uint32_t>(number64()); }
  float real() { return static_cast<float>(number32()) / 1000.0f; }
  std::string text(std::size_t most) {
    return std::string(number32() % (most + 1), static_cast<char>('a' + number32() % 26));
  }

 private:
  std::mt19937_64 bits_;
};

Envelope random_publish(Random& random) {
  Envelope envelope;
  Publish& publish = *envelope.mutable_publish();
  publish.set_publisher_id(random.number32());
  publish.set_publish_number(random.number64());
  publish.set_payload(random.text(300));
  if (random.coin()) publish.set_ttl(random.number32());
  if (random.coin()) publish.set_sent_at_ns(random.number64());
  return envelope;
}

Envelope random_usual_deliver(Random& random) {
  Envelope envelope;
  Deliver& deliver = *envelope.mutable_deliver();
  deliver.set_subscription_id(random.number32());
  deliver.set_payload(random.text(300));
  deliver.set_channel(random.number32());
  deliver.set_sender(random.number32());
  deliver.set_message_number(random.number32());
  if (random.coin()) deliver.set_distance_m(random.real());
  if (random.coin()) deliver.set_bearing_rad(random.real());
  if (random.coin()) {
    Pose& pose = *deliver.mutable_sender_pose();
    pose.set_x_m(random.real());
    pose.set_y_m(random.real());
    pose.set_theta_rad(random.real());
    pose.set_age_ms(random.number32());
  }
  if (random.coin()) deliver.set_transmitter(random.number32() | 1);  // 0 is nobody: not written
  deliver.set_hops(random.number32());
  deliver.set_ttl(random.number32());
  if (random.coin()) deliver.set_buffering_delay_us(random.number64());
  if (random.coin()) deliver.set_received_at_ns(random.number64());
  if (random.coin()) deliver.set_local(true);
  deliver.set_epoch(random.number32());
  return envelope;
}

void add_losses_and_gateway(Random& random, Deliver& deliver) {
  if (random.coin()) {
    LostBefore& lost = *deliver.mutable_lost_before();
    lost.set_air(random.number32() | 1);
    lost.set_kernel(random.number32());
    lost.set_daemon(random.number32());
    lost.set_late(random.number32());
  }
  if (random.coin()) deliver.mutable_origin();
  if (random.coin()) {
    GatewayOrigin& origin = *deliver.mutable_origin();
    origin.set_link("w" + random.text(200));
    origin.set_node(random.number32());
    origin.set_message_number(random.number32());
  }
}

TEST(PublishFrame, HasTheBytesThatProtobufWrites) {
  Random random(1);
  for (int i = 0; i < kRandomFrames; ++i) {
    const Envelope envelope = random_publish(random);
    ASSERT_EQ(bytes_of(frame_of(envelope.publish())), bytes_of(envelope)) << "frame " << i;
  }
}

TEST(PublishFrame, IsReadAsItWasWritten) {
  Random random(2);
  for (int i = 0; i < kRandomFrames; ++i) {
    const std::string bytes = envelope_of(random_publish(random));
    PublishFrame frame;
    ASSERT_TRUE(parse(bytes, frame)) << "frame " << i;
    ASSERT_EQ(envelope_of(frame), bytes) << "frame " << i;
  }
}

TEST(SentFrame, HasTheBytesThatProtobufWrites) {
  Random random(4);
  for (int i = 0; i < kRandomFrames; ++i) {
    Envelope envelope;
    Sent& sent = *envelope.mutable_sent();
    const SentFrame frame{random.number32(), random.number64()};
    sent.set_publisher_id(frame.publisher_id);
    sent.set_publish_number(frame.publish_number);
    ASSERT_EQ(bytes_of(frame), bytes_of(envelope)) << "seed 4, frame " << i;
  }
}

TEST(DeliverFrame, HasTheBytesThatProtobufWrites) {
  Random random(3);
  for (int i = 0; i < kRandomFrames; ++i) {
    Envelope envelope = random_usual_deliver(random);
    add_losses_and_gateway(random, *envelope.mutable_deliver());
    ASSERT_EQ(bytes_of(frame_of(envelope.deliver())), bytes_of(envelope)) << "frame " << i;
  }
}

TEST(DeliverFrame, IsReadAsItWasWritten) {
  Random random(4);
  for (int i = 0; i < kRandomFrames; ++i) {
    const std::string bytes = envelope_of(random_usual_deliver(random));
    DeliverFrame frame;
    ASSERT_TRUE(parse(bytes, frame)) << "frame " << i;
    ASSERT_EQ(envelope_of(frame), bytes) << "frame " << i;
  }
}

TEST(DeliverFrame, KeepsTheBufferWhenItIsTooLong) {
  const std::string payload(kMaxEnvelopeBytes, 'x');
  DeliverFrame frame;
  frame.payload = payload;
  std::string buffer = "before";
  EXPECT_FALSE(append_frame(frame, buffer));
  EXPECT_EQ(buffer, "before");
  frame.payload = std::string_view(payload).substr(8);
  EXPECT_TRUE(append_frame(frame, buffer));
  EXPECT_EQ(buffer.size(), 6 + kLengthBytes + kMaxEnvelopeBytes);
}

TEST(MessageFrames, LeaveOtherEnvelopesToProtobuf) {
  Random random(5);
  Envelope two = random_publish(random);
  two.mutable_done();
  Envelope asked = random_publish(random);
  asked.set_request_id(1);
  Envelope lost = random_usual_deliver(random);
  lost.mutable_deliver()->mutable_lost_before()->set_air(1);
  Envelope crossed = random_usual_deliver(random);
  crossed.mutable_deliver()->mutable_origin();
  Envelope half_a_pose = random_usual_deliver(random);
  half_a_pose.mutable_deliver()->mutable_sender_pose()->clear_x_m();
  half_a_pose.mutable_deliver()->mutable_sender_pose()->set_y_m(1);
  for (const Envelope& envelope : {two, asked, lost, crossed, half_a_pose, Envelope()}) {
    const std::string bytes = envelope.SerializeAsString();
    PublishFrame publish;
    EXPECT_FALSE(parse(bytes, publish)) << envelope.ShortDebugString();
    DeliverFrame deliver;
    EXPECT_FALSE(parse(bytes, deliver)) << envelope.ShortDebugString();
  }
}

TEST(MessageFrames, LeaveUnusualBytesToProtobuf) {
  // Field 11 is publish: tag 5a, length; publisher_id 08, publish_number 10, payload 1a.
  for (const std::string& bytes : {
           std::string("\x5a", 1),                              // no length
           std::string("\x5a\x02\x08", 3),                      // shorter than it says
           std::string("\x5a\x02\x08\x80", 4),                  // a number that does not end
           std::string("\x5a\x03\x08\x81\x00", 5),              // longer than need be
           std::string("\x5a\x06\x08\x80\x80\x80\x80\x10", 8),  // an id of 33 bits
           std::string("\x5a\x02\x1a\x05", 4),                  // a payload beyond the end
           std::string("\x5a\x02\x78\x01", 4),                  // field 15, not known
           std::string("\x5a\x02\x0a\x00", 4),                  // the id as a text
           std::string("\x5a\x01\x00", 3),                      // field 0
       }) {
    PublishFrame frame;
    EXPECT_FALSE(parse(bytes, frame)) << testing::PrintToString(bytes);
  }
}

}  // namespace
}  // namespace swarmtalk::ipc
