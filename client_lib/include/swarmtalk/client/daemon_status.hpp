// What the daemon says about itself: links, channels, counters. Plain values.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <swarmtalk/client/message.hpp>

namespace swarmtalk {

/// A count since the daemon started; docs/operations.md says what each means.
struct Counter {
  std::string name;
  std::uint64_t value = 0;
};

/// One link of the daemon: a radio or a wire.
struct LinkStatus {
  std::string name;
  std::string type;     // raw_l2, udp, replay
  std::string device;   // interface, group or file
  std::string profile;  // wire format
  bool up = false;
  std::string state;  // one line for a person
  std::uint32_t mtu_bytes = 0;
  std::uint32_t max_message_bytes = 0;
  std::uint32_t max_ttl = 0;
  std::uint32_t node_id = 0;  // under which it speaks: the daemon's, or the link's own
  std::uint32_t max_channel = 0;
  std::vector<Counter> counters;
};

/// A channel that programs of this robot use.
struct ChannelStatus {
  std::uint16_t number = 0;
  std::string name;
  std::uint32_t publishers = 0;
  std::uint32_t subscribers = 0;
  std::uint32_t onlookers = 0;  // of these, those that look on (Policy::looking_on())
  bool timestamped = false;
  std::vector<std::string> links;  // that carry it
  std::uint64_t received = 0;      // from the air, while somebody on this robot subscribes
  Loss lost;                       // of these, before they came to any subscription's queue
  std::uint64_t refused = 0;       // messages of programs here that send() could not take
};

/// A program that the daemon serves.
struct ClientStatus {
  std::string name;
  std::uint32_t pid = 0;
  std::uint32_t uid = 0;
  std::uint32_t subscriptions = 0;
  std::uint32_t publishers = 0;
  std::uint32_t queued_messages = 0;  // that wait for it in the daemon
  std::uint64_t queued_bytes = 0;
  std::uint64_t deliveries_sent = 0;
  std::uint64_t lost_daemon = 0;  // dropped by the daemon because they waited for this program
  std::uint64_t lost_client = 0;  // dropped in the program, as it says
  std::uint64_t messages_published = 0;
  std::uint64_t refused = 0;  // messages of it that send() could not take
};

/// One of the things that programs share, as a user has it.
struct ShareStatus {
  std::string name;
  std::uint64_t used = 0;
  std::uint64_t limit = 0;  // 0: none for this user
};

/// What all programs of one user hold of what all share.
struct UserStatus {
  std::uint32_t uid = 0;
  bool is_operator = false;  // root, or the daemon's own user
  std::vector<ShareStatus> shares;
};

/// A robot heard on a link within the last 10 s.
struct Neighbour {
  std::string link;
  std::uint32_t node_id = 0;
  std::uint32_t epoch = 0;                // tells two starts of its daemon apart
  std::string address;                    // MAC, or IPv4 address and port; empty: not known
  std::chrono::milliseconds age{0};       // since it was heard last
  float distance_m = Message::kUnknown;   // when it was heard last
  float bearing_rad = Message::kUnknown;  // counter-clockwise from our heading
  std::optional<Pose> pose;               // the last it sent, with its age now
  std::uint64_t frames = 0;               // heard
  std::uint64_t frames_lost = 0;          // gaps in its count of frames
  float loss = 0;                         // share of its frames that were lost lately, 0 to 1
  bool duplicate_id = false;              // another robot with this id is heard too
  bool out_of_range = false;              // of the link's virtual_range_m: its messages are dropped
  std::optional<int> signal_dbm;          // none: not told, or through an access point
  bool is_ghost = false;                  // simulated, on the air of real robots
};

/// All that the daemon says about itself.
struct DaemonStatus {
  std::string version;
  std::uint32_t node_id = 0;
  bool node_id_fixed = false;  // configured; otherwise it changes on collision
  std::string node_id_source;  // for people: "from the host's name 'robot-07'"
  std::uint32_t epoch = 0;
  std::chrono::milliseconds uptime{0};
  std::uint32_t clients = 0;
  std::optional<Pose> pose;
  // Of the last pose, also when it is too old and `pose` is empty:
  std::optional<std::chrono::milliseconds> pose_age;  // none: nobody has told a pose
  std::string pose_told_by;  // a program's name, or "the configuration", "the pose socket"
  std::chrono::milliseconds pose_max_age{0};  // older than that it is left out; 0: no limit
  std::vector<LinkStatus> links;
  std::vector<ChannelStatus> channels;
  std::vector<ClientStatus> clients_served;  // those with most to read first, at most 128
  std::vector<UserStatus> users;             // that have programs here, at most 32
  std::vector<Counter> counters;
  std::string config_file;
};

}  // namespace swarmtalk
