// The daemon's answers as C++ programs get them: each field has a value of its own, so that none
// can stand in another's place.
#include "client_lib/convert.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <gtest/gtest.h>

namespace swarmtalk::client {
namespace {

using google::protobuf::FieldDescriptor;

/// Every field, of repeated ones two.
class Filler {
 public:
  void fill(google::protobuf::Message& message) {
    const auto* const descriptor = message.GetDescriptor();
    for (int i = 0; i < descriptor->field_count(); ++i) {
      const FieldDescriptor& field = *descriptor->field(i);
      if (field.containing_oneof() != nullptr && !field.has_presence()) continue;
      put(message, field);
      if (field.is_repeated()) put(message, field);
    }
  }

 private:
  void put(google::protobuf::Message& message, const FieldDescriptor& field) {
    const auto& values = *message.GetReflection();
    const unsigned count = ++count_;
    const bool is_list = field.is_repeated();
    switch (field.cpp_type()) {
      case FieldDescriptor::CPPTYPE_UINT32:
        values.SetUInt32(&message, &field, count);
        break;
      case FieldDescriptor::CPPTYPE_UINT64:
        values.SetUInt64(&message, &field, count);
        break;
      case FieldDescriptor::CPPTYPE_INT32:
        values.SetInt32(&message, &field, -static_cast<int>(count));
        break;
      case FieldDescriptor::CPPTYPE_FLOAT:
        values.SetFloat(&message, &field, static_cast<float>(count) + 0.5f);
        break;
      case FieldDescriptor::CPPTYPE_DOUBLE:
        values.SetDouble(&message, &field, count + 0.25);
        break;
      case FieldDescriptor::CPPTYPE_BOOL:
        values.SetBool(&message, &field, ++bools_ % 2 == 0);
        break;
      case FieldDescriptor::CPPTYPE_STRING: {
        const std::string text = std::string(field.name()) + " " + std::to_string(count);
        if (is_list) {
          values.AddString(&message, &field, text);
        } else {
          values.SetString(&message, &field, text);
        }
        break;
      }
      case FieldDescriptor::CPPTYPE_MESSAGE:
        fill(is_list ? *values.AddMessage(&message, &field)
                     : *values.MutableMessage(&message, &field));
        break;
      default:
        ADD_FAILURE() << field.name();
    }
  }

  unsigned count_ = 100;
  unsigned bools_ = 0;
};

void expect_same(const std::vector<Counter>& to,
                 const google::protobuf::RepeatedPtrField<ipc::Counter>& from) {
  ASSERT_EQ(to.size(), 2u);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(to[static_cast<std::size_t>(i)].name, from[i].name());
    EXPECT_EQ(to[static_cast<std::size_t>(i)].value, from[i].value());
  }
}

void expect_same(const Pose& to, const ipc::Pose& from) {
  EXPECT_EQ(to.x_m, from.x_m());
  EXPECT_EQ(to.y_m, from.y_m());
  EXPECT_EQ(to.theta_rad, from.theta_rad());
  EXPECT_EQ(static_cast<std::uint32_t>(to.age.count()), from.age_ms());
}

TEST(Convert, ARefusalIsTheStatusOfItsName) {
  const std::pair<ipc::ErrorCode, StatusCode> kCodes[] = {
      {ipc::ERROR_UNSPECIFIED, StatusCode::kProtocol},
      {ipc::ERROR_VERSION, StatusCode::kVersionMismatch},
      {ipc::ERROR_MALFORMED, StatusCode::kProtocol},
      {ipc::ERROR_TOO_LONG, StatusCode::kTooLong},
      {ipc::ERROR_BUSY, StatusCode::kBusy},
      {ipc::ERROR_BAD_CHANNEL, StatusCode::kBadChannel},
      {ipc::ERROR_CHANNEL_CONFLICT, StatusCode::kChannelConflict},
      {ipc::ERROR_LIMIT, StatusCode::kLimit},
      {ipc::ERROR_UNKNOWN_ID, StatusCode::kProtocol},
      {ipc::ERROR_BAD_TTL, StatusCode::kBadTtl},
      {ipc::ERROR_BAD_POSE, StatusCode::kBadPose},
      {ipc::ERROR_UNSUPPORTED, StatusCode::kUnsupported},
      {ipc::ERROR_LINK_DOWN, StatusCode::kLinkDown},
      {ipc::ERROR_BAD_DISTANCE, StatusCode::kBadArgument},
      {ipc::ERROR_DROPPED, StatusCode::kDropped},
      {ipc::ERROR_RATE, StatusCode::kRate}};
  for (const auto& [theirs, ours] : kCodes) {
    ipc::Failure failure;
    failure.set_code(theirs);
    failure.set_text("because");
    EXPECT_EQ(convert(failure).code(), ours) << theirs;
    EXPECT_EQ(convert(failure).text(), "because");
  }
}

TEST(Convert, BringsAllOfTheStatus) {
  ipc::Status from;
  Filler().fill(from);
  DaemonStatus to;
  convert(from, to);
  EXPECT_EQ(to.version, from.version());
  EXPECT_EQ(to.node_id, from.node_id());
  EXPECT_EQ(to.node_id_fixed, from.node_id_fixed());
  EXPECT_EQ(to.node_id_source, from.node_id_source());
  EXPECT_EQ(to.epoch, from.epoch());
  EXPECT_EQ(static_cast<std::uint64_t>(to.uptime.count()), from.uptime_ms());
  EXPECT_EQ(to.clients, from.clients());
  EXPECT_EQ(to.config_file, from.config_file());
  ASSERT_TRUE(to.pose && to.pose_age);
  expect_same(*to.pose, from.pose());
  EXPECT_EQ(*to.pose_age, to.pose->age);
  EXPECT_EQ(to.pose_told_by, from.pose().told_by());
  EXPECT_EQ(static_cast<std::uint32_t>(to.pose_max_age.count()), from.pose().max_age_ms());
  expect_same(to.counters, from.counters());
}

TEST(Convert, BringsAllOfLinksAndChannels) {
  ipc::Status all;
  Filler().fill(all);
  DaemonStatus status;
  convert(all, status);
  ASSERT_EQ(status.links.size(), 2u);
  ASSERT_EQ(status.channels.size(), 2u);
  for (int i = 0; i < 2; ++i) {
    const ipc::LinkStatus& from = all.links(i);
    const LinkStatus& to = status.links[static_cast<std::size_t>(i)];
    EXPECT_EQ(to.name, from.name());
    EXPECT_EQ(to.type, from.type());
    EXPECT_EQ(to.device, from.device());
    EXPECT_EQ(to.profile, from.profile());
    EXPECT_EQ(to.up, from.up());
    EXPECT_EQ(to.state, from.state());
    EXPECT_EQ(to.mtu_bytes, from.mtu_bytes());
    EXPECT_EQ(to.max_message_bytes, from.max_message_bytes());
    EXPECT_EQ(to.max_ttl, from.max_ttl());
    EXPECT_EQ(to.node_id, from.node_id());
    EXPECT_EQ(to.max_channel, from.max_channel());
    expect_same(to.counters, from.counters());

    const ipc::ChannelStatus& told = all.channels(i);
    const ChannelStatus& channel = status.channels[static_cast<std::size_t>(i)];
    EXPECT_EQ(channel.number, told.number());
    EXPECT_EQ(channel.name, told.name());
    EXPECT_EQ(channel.publishers, told.publishers());
    EXPECT_EQ(channel.subscribers, told.subscribers());
    EXPECT_EQ(channel.onlookers, told.onlookers());
    EXPECT_EQ(channel.timestamped, told.timestamped());
    EXPECT_EQ(channel.received, told.received());
    EXPECT_EQ(channel.refused, told.refused());
    EXPECT_EQ(channel.links, (std::vector<std::string>{told.links(0), told.links(1)}));
    EXPECT_EQ(channel.lost.air, told.lost_air());
    EXPECT_EQ(channel.lost.kernel, told.lost_kernel());
    EXPECT_EQ(channel.lost.daemon, told.lost_daemon());
    EXPECT_EQ(channel.lost.client, 0u);
    EXPECT_EQ(channel.lost.late, told.late());
  }
}

TEST(Convert, BringsAllOfProgramsAndUsers) {
  ipc::Status all;
  Filler().fill(all);
  DaemonStatus status;
  convert(all, status);
  ASSERT_EQ(status.clients_served.size(), 2u);
  ASSERT_EQ(status.users.size(), 2u);
  for (int i = 0; i < 2; ++i) {
    const ipc::ClientStatus& from = all.clients_served(i);
    const ClientStatus& to = status.clients_served[static_cast<std::size_t>(i)];
    EXPECT_EQ(to.name, from.name());
    EXPECT_EQ(to.pid, from.pid());
    EXPECT_EQ(to.uid, from.uid());
    EXPECT_EQ(to.subscriptions, from.subscriptions());
    EXPECT_EQ(to.publishers, from.publishers());
    EXPECT_EQ(to.queued_messages, from.queued_messages());
    EXPECT_EQ(to.queued_bytes, from.queued_bytes());
    EXPECT_EQ(to.deliveries_sent, from.deliveries_sent());
    EXPECT_EQ(to.lost_daemon, from.lost_daemon());
    EXPECT_EQ(to.lost_client, from.lost_client());
    EXPECT_EQ(to.messages_published, from.messages_published());
    EXPECT_EQ(to.refused, from.refused());

    const UserStatus& user = status.users[static_cast<std::size_t>(i)];
    EXPECT_EQ(user.uid, all.users(i).uid());
    EXPECT_EQ(user.is_operator, all.users(i).is_operator());
    ASSERT_EQ(user.shares.size(), 2u);
    for (int k = 0; k < 2; ++k) {
      const ShareStatus& share = user.shares[static_cast<std::size_t>(k)];
      EXPECT_EQ(share.name, all.users(i).shares(k).name());
      EXPECT_EQ(share.used, all.users(i).shares(k).used());
      EXPECT_EQ(share.limit, all.users(i).shares(k).limit());
    }
  }
}

TEST(Convert, BringsAllOfNeighboursAndNothingThatIsNotKnown) {
  ipc::Neighbours all;
  Filler().fill(all);
  all.add_neighbours()->mutable_pose()->set_x_m(1);
  std::vector<Neighbour> neighbours(7);
  convert(all, neighbours);
  ASSERT_EQ(neighbours.size(), 3u);
  for (int i = 0; i < 2; ++i) {
    const ipc::Neighbour& from = all.neighbours(i);
    const Neighbour& to = neighbours[static_cast<std::size_t>(i)];
    EXPECT_EQ(to.link, from.link());
    EXPECT_EQ(to.node_id, from.node_id());
    EXPECT_EQ(to.epoch, from.epoch());
    EXPECT_EQ(to.address, from.address());
    EXPECT_EQ(static_cast<std::uint64_t>(to.age.count()), from.age_ms());
    EXPECT_EQ(to.distance_m, from.distance_m());
    EXPECT_EQ(to.bearing_rad, from.bearing_rad());
    ASSERT_TRUE(to.pose);
    expect_same(*to.pose, from.pose());
    EXPECT_EQ(to.frames, from.frames());
    EXPECT_EQ(to.frames_lost, from.frames_lost());
    EXPECT_EQ(to.loss, from.loss());
    EXPECT_EQ(to.duplicate_id, from.duplicate_id());
    EXPECT_EQ(to.out_of_range, from.out_of_range());
    EXPECT_EQ(to.signal_dbm, from.signal_dbm());
    EXPECT_EQ(to.is_ghost, from.ghost());
  }
  EXPECT_NE(neighbours[2].distance_m, neighbours[2].distance_m) << "not a number: not known";
  EXPECT_NE(neighbours[2].bearing_rad, neighbours[2].bearing_rad);
  EXPECT_FALSE(neighbours[2].pose || neighbours[2].signal_dbm);
}

TEST(Convert, BringsAllOfAMessageAndForgetsTheOneBefore) {
  ipc::DeliverFrame from;
  from.payload = "payload";
  from.channel = 101;
  from.sender = 102;
  from.message_number = 103;
  from.distance_m = 104.5f;
  from.bearing_rad = 105.5f;
  from.sender_pose = ipc::DeliverPose{106.5f, 107.5f, 108.5f, 109};
  from.hops = 110;
  from.ttl = 111;
  from.transmitter = 112;
  from.buffering_delay_us = 113;
  from.received_at_ns = 114;
  from.local = true;
  from.epoch = 115;
  from.lost_before = {116, 117, 118, 119};
  from.origin = ipc::DeliverOrigin{"air", 120, 121};
  Message to;
  convert(from, to);
  EXPECT_EQ(to.payload, "payload");
  EXPECT_EQ(to.channel, 101u);
  EXPECT_EQ(to.sender, 102u);
  EXPECT_EQ(to.message_number, 103u);
  EXPECT_EQ(to.distance_m, 104.5f);
  EXPECT_EQ(to.bearing_rad, 105.5f);
  ASSERT_TRUE(to.sender_pose);
  EXPECT_EQ(to.sender_pose->x_m, 106.5f);
  EXPECT_EQ(to.sender_pose->y_m, 107.5f);
  EXPECT_EQ(to.sender_pose->theta_rad, 108.5f);
  EXPECT_EQ(to.sender_pose->age, std::chrono::milliseconds(109));
  EXPECT_EQ(to.hops, 110u);
  EXPECT_EQ(to.ttl, 111u);
  EXPECT_EQ(to.transmitter, 112u);
  EXPECT_EQ(to.buffering_delay, std::chrono::microseconds(113));
  ASSERT_TRUE(to.received_at);
  EXPECT_EQ(to.received_at->time_since_epoch(), std::chrono::nanoseconds(114));
  EXPECT_TRUE(to.local);
  EXPECT_EQ(to.epoch, 115u);
  EXPECT_EQ(to.lost_before.air, 116u);
  EXPECT_EQ(to.lost_before.kernel, 117u);
  EXPECT_EQ(to.lost_before.daemon, 118u);
  EXPECT_EQ(to.lost_before.client, 0u);
  EXPECT_EQ(to.lost_before.late, 119u);
  ASSERT_TRUE(to.origin);
  EXPECT_EQ(to.origin->link, "air");
  EXPECT_EQ(to.origin->node, 120u);
  EXPECT_EQ(to.origin->message_number, 121u);

  ipc::DeliverFrame bare;
  bare.sender = 7;
  convert(bare, to);
  EXPECT_EQ(to.payload, "");
  EXPECT_EQ(to.transmitter, 7u) << "the sender itself";
  EXPECT_FALSE(to.has_distance() || to.has_bearing() || to.sender_pose || to.buffering_delay ||
               to.received_at || to.local || to.origin || to.lost_before);
}

}  // namespace
}  // namespace swarmtalk::client
