// Prints frames of the local protocol as protobuf makes them, a line each: name and hexadecimal.
// The Python client, which makes its frames by hand, is held against these.
#include <cstdint>
#include <cstdio>
#include <string>

#include "ipc/framing.hpp"

namespace {

using namespace swarmtalk::ipc;

void print(const char* name, const Envelope& envelope) {
  std::string bytes;
  if (!append_frame(envelope, bytes)) return;
  std::printf("%s ", name);
  for (const char byte : bytes) std::printf("%02x", static_cast<unsigned char>(byte));
  std::printf("\n");
}

Envelope request(std::uint32_t id) {
  Envelope envelope;
  envelope.set_request_id(id);
  return envelope;
}

void print_requests() {
  Envelope hello;
  hello.mutable_hello()->set_major(kProtocolMajor);
  hello.mutable_hello()->set_minor(kProtocolMinor);
  hello.mutable_hello()->set_name("gr\xc3\xbc\xc3\x9f");
  print("hello", hello);

  Envelope subscribe = request(1);
  Subscribe& wanted = *subscribe.mutable_subscribe();
  wanted.mutable_channel()->set_name("c");
  wanted.set_keep_last(300);
  wanted.set_max_distance_m(1.5f);
  wanted.set_drop_unknown_distance(true);
  wanted.set_timestamped(false);
  wanted.set_latest_of_each(true);
  wanted.set_max_age_ms(2500);
  print("subscribe", subscribe);

  Envelope advertise = request(2);
  Advertise& offered = *advertise.mutable_advertise();
  offered.mutable_channel()->set_number(65535);
  offered.set_ttl(4);
  offered.set_timestamped(true);
  offered.set_queue(200);
  offered.set_drop_oldest(true);
  offered.set_copies(3);
  offered.set_copy_interval_ms(150);
  offered.set_redundancy(12);
  print("advertise", advertise);

  Envelope plain = request(3);
  plain.mutable_advertise()->mutable_channel()->set_number(0);
  plain.mutable_advertise()->set_queue(16);
  plain.mutable_advertise()->set_sent_every(4);
  print("advertise_plain", plain);

  Envelope follows = request(4);
  follows.mutable_advertise()->mutable_channel()->set_number(1);
  follows.mutable_advertise()->set_auto_redundancy(true);
  print("advertise_auto", follows);

  Envelope pose = request(5);
  pose.mutable_set_pose()->set_x_m(-1.25f);
  pose.mutable_set_pose()->set_y_m(2);
  pose.mutable_set_pose()->set_theta_rad(3.1415927f);
  pose.mutable_set_pose()->set_fixed(true);
  print("set_pose", pose);

  Envelope publish;
  publish.mutable_publish()->set_publisher_id(200);
  publish.mutable_publish()->set_publish_number(1);
  publish.mutable_publish()->set_payload(std::string(200, 'x'));
  publish.mutable_publish()->set_ttl(0);
  print("publish", publish);
  publish.mutable_publish()->clear_payload();
  publish.mutable_publish()->set_publish_number(2);
  publish.mutable_publish()->clear_ttl();
  print("publish_nothing", publish);

  Envelope loss;
  loss.mutable_client_loss()->set_subscription_id(7);
  loss.mutable_client_loss()->set_messages(1000);
  print("client_loss", loss);
  loss.Clear();
  loss.mutable_client_loss()->set_publisher_id(200);
  loss.mutable_client_loss()->set_refused(300);
  print("client_refused", loss);
}

void print_deliveries() {
  Envelope envelope;
  Deliver& deliver = *envelope.mutable_deliver();
  deliver.set_subscription_id(1);
  print("deliver_nothing", envelope);
  deliver.set_payload(std::string("\0\xff\n", 3));
  deliver.set_channel(41000);
  deliver.set_sender(65534);
  deliver.set_message_number(4000000000u);
  deliver.set_distance_m(0.5f);
  deliver.set_bearing_rad(-1.25f);
  deliver.mutable_sender_pose()->set_x_m(-3.5f);
  deliver.mutable_sender_pose()->set_y_m(0);
  deliver.mutable_sender_pose()->set_theta_rad(1.5f);
  deliver.mutable_sender_pose()->set_age_ms(1500);
  deliver.set_hops(2);
  deliver.set_ttl(5);
  deliver.set_buffering_delay_us(1500000);
  deliver.set_received_at_ns(UINT64_C(123456789012345678));
  deliver.set_local(true);
  deliver.set_epoch(4294967295u);
  deliver.mutable_lost_before()->set_air(1);
  deliver.mutable_lost_before()->set_kernel(2);
  deliver.mutable_lost_before()->set_daemon(3);
  deliver.mutable_lost_before()->set_late(4);
  deliver.set_transmitter(8);
  deliver.mutable_origin()->set_link("serial");
  deliver.mutable_origin()->set_node(9);
  deliver.mutable_origin()->set_message_number(77);
  print("deliver", envelope);
}

}  // namespace

int main() {
  print_requests();
  print_deliveries();
}
