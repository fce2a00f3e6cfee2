// Configuration of swarmtalkd: plain values with their defaults and limits, and nothing else. The
// one place for the daemon's tunables. config_parser.hpp fills it from a file;
// docs/configuration.md describes each key.
#pragma once

#include <sys/types.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "frame/air_frame.hpp"

namespace swarmtalk::daemon {

inline constexpr const char* kDefaultConfigPath = "/etc/swarmtalk/swarmtalkd.toml";

/// The legal range of an integer key.
struct IntegerLimits {
  std::int64_t least;
  std::int64_t most;
};

inline constexpr IntegerLimits kNodeIdLimits{1, 65534};  // 0 and 65535 are never on the air
inline constexpr IntegerLimits kNodeIdOffsetLimits{-65534, 65534};
inline constexpr IntegerLimits kMetricsIntervalSLimits{1, 3600};
inline constexpr IntegerLimits kChannelLimits{0, 65535};
inline constexpr IntegerLimits kPoseMaxAgeMsLimits{0, 3'600'000};
inline constexpr IntegerLimits kEthertypeLimits{0x0600, 0xFFFF};  // below: a length, not a type
inline constexpr IntegerLimits kPortLimits{1, 65535};
inline constexpr IntegerLimits kBurstLimits{1, 10'000};
inline constexpr IntegerLimits kJitterUsLimits{0, 1'000'000};
inline constexpr IntegerLimits kBeaconMsLimits{0, 3'600'000};
inline constexpr IntegerLimits kForwardTtlLimits{1, 255};
inline constexpr IntegerLimits kForwardWaitMsLimits{0, 600'000};
inline constexpr std::uint32_t kLeastBeaconMs = 20;  // but 0: none
inline constexpr IntegerLimits kReceiveBufferLimits{4096, 64 << 20};
inline constexpr double kMaxRateHz = 1e6;
inline constexpr double kMaxAirRateMbps = 10'000.0;
inline constexpr double kMaxVirtualRangeM = 1000.0;
inline constexpr double kMaxPoseM = 32.767;  // what the air frame can say
inline constexpr std::size_t kMaxLinks = 8;
inline constexpr std::size_t kMaxGatewayRules = 256;
inline constexpr IntegerLimits kGatewayQueueLimits{1, 1024};

/// A position in the swarm's frame of reference.
struct FixedPose {
  double x_m = 0.0;
  double y_m = 0.0;
  double theta_rad = 0.0;  // counter-clockwise from +x
  bool operator==(const FixedPose&) const = default;
};

enum class NodeIdRule : std::uint8_t { kRandom, kNumber, kHostname, kAddress };

constexpr const char* kIdByChance = "chosen at random";  // NodeConfig::id_source

struct NodeConfig {
  NodeIdRule id_rule = NodeIdRule::kRandom;  // node_id_rule.hpp
  std::optional<std::uint16_t> id;           // kNumber; of the other rules when it is resolved
  std::string id_source;                     // where it is from, for people, when it is resolved
  std::int32_t id_offset = 0;                // added to what kHostname and kAddress find
  std::string id_interface;                  // kAddress; empty: the only one
  std::optional<FixedPose> pose;             // none: unknown until a client sets it
  std::string pose_socket;                   // of datagrams with poses; empty: none
  std::string name;                          // told in reports; empty: none
  std::uint32_t pose_max_age_ms = 2000;  // an older pose is unknown; 0: a pose never gets too old
};

struct SocketConfig {
  std::string path;  // parser's default: ipc::kDefaultSocketPath
  mode_t mode = 0660;
  std::string group;  // empty: the process's own
};

/// A radio reaches farther than the robots of a small arena should hear each other.
struct VirtualRange {
  double limit_m = 0.0;        // packets from farther are dropped; 0: none is
  bool drops_unknown = false;  // with a limit: those from an unknown distance too
};

/// How far and for how long packets of others are sent on: the end of every flood, also of one that
/// an attacker has made (docs/decisions/0037-floods-end.md).
struct Forwarding {
  bool is_on = true;
  std::uint8_t max_ttl = 16;         // hops that a packet may still have here
  std::uint32_t max_wait_ms = 5000;  // a packet that waited here for longer is dropped; 0: none is
};

enum class LinkType : std::uint8_t { kRawL2, kUdp, kReplay, kKilobot };

/// The keys of a [links.NAME] section of type "kilobot". docs/kilobot.md explains them.
struct KilobotConfig {
  std::string downlink;            // the overhead controller's serial device; empty: none
  std::string uplink;              // the gateway's; may be the same; empty: none
  bool is_text = false;            // the uplink brings lines of text
  std::uint16_t text_channel = 0;  // with is_text: where they are published, on this daemon
  bool ohc_single = false;
  std::uint32_t baud = 38400;
  std::uint32_t copies = 3;
  std::uint32_t settle_ms = 3500;
  double time_scale = 1.0;

  bool operator==(const KilobotConfig&) const = default;
};

/// One [links.NAME] section. Which members count depends on the type.
struct LinkConfig {
  std::string name;
  LinkType type = LinkType::kRawL2;
  frame::ProfileId profile = frame::ProfileId::kWifi;
  std::optional<std::uint16_t> node_id;  // none: the daemon's, if the profile has room for it
  bool is_gateway_target = false;        // some gateway rule copies to it
  std::string interface;                 // raw_l2, udp (there optional)
  std::uint16_t ethertype = 0x88B5;      // raw_l2, replay
  std::string address;                   // udp; empty: the driver's default group
  std::uint16_t port = 0;                // udp; 0: the driver's default
  std::string file;                      // replay: capture to receive from
  std::string output;                    // replay: capture to transmit to; empty: nowhere
  bool is_fastest = false;               // replay: not at the recorded pace
  std::string key_file;                  // raw_l2, udp, replay; empty: no swarm key
  std::string also_key_file;             // with key_file: its frames are taken as well; empty: none
  bool checks_freshness = true;          // raw_l2, udp: of sealed frames
  VirtualRange virtual_range;            // raw_l2, udp, replay
  bool hears_ghosts = true;              // raw_l2, udp, replay: packets of simulated robots
  Forwarding forwarding;
  double rate_hz = 0.0;  // frames/s; 0: unlimited
  std::uint32_t burst_frames = 1;
  std::uint32_t jitter_us = 0;
  std::optional<std::uint32_t> forward_jitter_us;   // none: as the interface needs it
  double air_rate_mbps = 0.0;                       // raw_l2, udp; 0: not known
  std::uint32_t beacon_ms = 0;                      // raw_l2, udp; 0: never
  std::optional<std::size_t> receive_buffer_bytes;  // raw_l2, udp; none: what the driver asks for
  KilobotConfig kilobot;
};

/// One direction of a [[gateway]]: what comes on a channel of one link leaves on one of another.
struct GatewayRule {
  std::size_t from_link = 0;  // index into Config::links
  std::uint16_t from_channel = 0;
  std::size_t to_link = 0;
  std::uint16_t to_channel = 0;
  std::optional<std::uint8_t> ttl;   // none: what the message has left
  std::uint32_t queue_messages = 8;  // copies that wait for the link; a newer one drops the oldest
};

struct LimitsConfig {
  std::uint32_t clients = 64;
  std::uint32_t clients_per_user = 48;  // root and the daemon's own user may have all
  std::uint32_t operator_clients = 4;   // of `clients`, kept for those two; at most a quarter
  std::uint32_t channels_per_client = 48;
  std::uint32_t channels_per_user = 56;  // these three not of root and the daemon's own user
  std::uint32_t subscriptions_per_user = 1024;
  std::uint32_t publishers_per_user = 512;
  std::uint32_t subscriptions_per_client = 64;
  std::uint32_t publishers_per_client = 64;
  std::uint32_t queue_messages = 64;             // of a subscription that asks for nothing else
  std::uint32_t queue_messages_max = 1024;       // that a subscription may ask for
  std::uint32_t queue_bytes = 1 << 20;           // payload that waits for one client
  std::uint32_t reply_bytes = 256 << 10;         // replies that wait for one client
  std::uint32_t socket_buffer_bytes = 64 << 10;  // kernel's buffer towards one client
  std::uint32_t waiting_messages = 1024;         // publications that wait for a link, all clients
  std::uint32_t waiting_messages_per_client = 384;
  std::uint32_t waiting_messages_per_user = 640;
  std::uint32_t waiting_bytes = 16 << 20;         // payload of them; one user may have half
  std::uint32_t requests_per_client_hz = 50'000;  // but messages; a status counts as 32. 0: any
  std::uint32_t requests_per_user_hz = 100'000;
  std::uint32_t changes_per_user_hz = 5;  // reload, log level, node id, capture. 0: any
  std::uint32_t changes_burst = 20;       // that may come at once after a pause
  std::uint32_t publish_queue_max = 256;  // that a publisher may ask for
  std::uint32_t publish_rate_hz = 0;      // messages per second of one client; 0: any
  std::uint32_t publish_burst = 100;      // that may come at once after a pause
  std::uint32_t copies_max = 10;          // of a message, that a publisher may ask for
  std::uint32_t copy_interval_ms = 20;    // between them, of one that does not say
  std::uint32_t tracked_senders = 4096;   // senders and channels followed for lost messages
};

/// Channels with a meaning of their own, off unless asked for: nobody publishes on them then.
struct ReservedConfig {
  bool debug = false;          // log lines of programs
  bool harvest = false;        // questions for values of programs, and their answers
  bool report = false;         // the daemon reports on harvest while somebody looks
  std::uint32_t rate_hz = 10;  // messages per second of this robot on each of the two
  std::uint32_t burst = 20;    // at once after a pause
};

struct MetricsConfig {
  std::string file;  // Prometheus text for node_exporter; empty: none
  std::uint32_t interval_s = 15;
};

struct Config {
  NodeConfig node;
  SocketConfig socket;
  std::vector<LinkConfig> links;                  // in the order of the file
  std::map<std::string, std::uint16_t> channels;  // name to number
  std::vector<GatewayRule> gateways;
  LimitsConfig limits;
  std::string log_level = "info";
  std::map<std::string, std::string> log_levels;  // by subsystem, where it has its own
  MetricsConfig metrics;
  ReservedConfig reserved;
};

}  // namespace swarmtalk::daemon
