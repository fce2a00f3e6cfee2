#include "daemon/operator/counter_list.hpp"

#include <algorithm>

namespace swarmtalk::daemon {
namespace {

constexpr CounterOwner kDaemon = CounterOwner::kDaemon;
constexpr CounterOwner kLink = CounterOwner::kLink;

constexpr CounterHelp kCounters[] = {
    {kDaemon, "clients_accepted", "connections of programs since start"},
    {kDaemon, "clients_refused", "connections refused because limits.clients was reached"},
    {kDaemon, "clients_malformed", "connections closed for bytes that are not a legal frame"},
    {kDaemon, "clients_other_version", "connections closed for another protocol major"},
    {kDaemon, "clients_silent", "connections closed for no Hello within 10 s"},
    {kDaemon, "clients_not_reading",
     "programs that left their replies unread, and were read no further"},
    {kDaemon, "requests_refused", "requests answered with a failure, publications included"},
    {kDaemon, "requests_too_fast", "requests refused because a client or a user asked too often"},
    {kDaemon, "shares_refused", "subscriptions and publishers beyond a client's or a user's share"},
    {kDaemon, "messages_over_share", "messages refused because too many wait for a link"},
    {kDaemon, "log_lines_lost", "log lines dropped because nobody read them in time"},
    {kDaemon, "messages_published", "messages accepted from programs"},
    {kDaemon, "messages_sent", "accepted messages whose last packet has left on a link"},
    {kDaemon, "messages_busy", "messages refused because the publisher's previous one waits"},
    {kDaemon, "messages_busy_in_client", "messages that programs refused themselves, as they say"},
    {kDaemon, "messages_link_down", "messages refused or given up because no link is up"},
    {kDaemon, "messages_over_mtu", "messages refused because an interface's MTU is too small"},
    {kDaemon, "messages_dropped_queue", "messages dropped from a publisher's queue for newer ones"},
    {kDaemon, "messages_too_fast", "messages refused for limits.publish_rate_hz"},
    {kDaemon, "reports_sent", "reports of this robot, while somebody looks"},
    {kDaemon, "reports_received", "reports of other robots"},
    {kDaemon, "reports_unreadable", "reports that are damaged, of another version, or forwarded"},
    {kDaemon, "pings_answered", "questions of swarmtalk-cli ping to this robot"},
    {kDaemon, "pings_unanswered", "questions that were too many, or that no link could answer"},
    {kDaemon, "reserved_too_fast", "messages refused for reserved.rate_hz"},
    {kDaemon, "copies_sent", "repeats of messages that are sent several times"},
    {kDaemon, "messages_received", "whole messages from links that a local program subscribes to"},
    {kDaemon, "messages_lost_air", "messages missing in a sender's count, lost on the air"},
    {kDaemon, "messages_lost_kernel", "missing messages put down to frames the kernel dropped"},
    {kDaemon, "messages_lost_memory", "missing messages put down to a node's want of memory"},
    {kDaemon, "messages_late", "messages counted as lost before that came after all"},
    {kDaemon, "numbers_not_believed",
     "messages whose number is farther ahead than they can have been sent"},
    {kDaemon, "beacons_not_believed", "beacons that tell of more messages than can have been sent"},
    {kDaemon, "deliveries_queued", "messages queued, one for each subscription they go to"},
    {kDaemon, "deliveries_sent", "queued messages handed to the kernel for a program"},
    {kDaemon, "deliveries_too_far", "messages from beyond a subscription's max_distance"},
    {kDaemon, "deliveries_unknown_distance", "messages dropped by drop_unknown_distance"},
    {kDaemon, "deliveries_dropped_full", "oldest messages dropped from a full queue of a program"},
    {kDaemon, "deliveries_dropped_bytes", "messages dropped from queues for limits.queue_bytes"},
    {kDaemon, "deliveries_dropped_old", "messages dropped because a max_age was over"},
    {kDaemon, "deliveries_dropped_closed", "messages that waited for a program that went away"},
    {kDaemon, "deliveries_lost_in_client", "messages dropped by a program's own queue, as it says"},
    {kDaemon, "duplicate_node_ids", "packets of another transmitter or origin under our node id"},
    {kDaemon, "node_id_changes", "times that an automatic node id was drawn again"},
    {kDaemon, "duplicate_neighbours", "pairs of other robots that were heard under one node id"},
    {kDaemon, "poses_received", "poses that came over the pose socket"},
    {kDaemon, "poses_refused", "datagrams on the pose socket that are not a pose"},
    {kDaemon, "link_duplicates", "messages heard before over another link or by another gateway"},
    {kDaemon, "gateway_sent", "copies that gateway rules made, whose last packet has left"},
    {kDaemon, "gateway_crossed", "messages that no rule copies, for they crossed a gateway before"},
    {kDaemon, "gateway_there", "messages not copied because another gateway's copy was heard"},
    {kDaemon, "gateway_full", "oldest waiting copies dropped for newer ones"},
    {kDaemon, "gateway_too_long", "messages not copied because the other link has no room"},
    {kDaemon, "gateway_empty", "messages of 0 bytes that the other link cannot carry"},
    {kDaemon, "gateway_link_down", "copies not made or given up because the other link is down"},
    {kLink, "frames_sent", "air frames handed to the kernel"},
    {kLink, "frames_received", "air frames that are readable and of our profile"},
    {kLink, "packets_sent", "packets in the frames sent"},
    {kLink, "packets_received", "packets in the frames received"},
    {kLink, "bytes_sent", "bytes of air frames sent, without Ethernet, IP and UDP headers"},
    {kLink, "bytes_received", "bytes of air frames received, without headers and padding"},
    {kLink, "frames_truncated", "frames that end before they should"},
    {kLink, "frames_other_version", "frames of another version of the air frame"},
    {kLink, "frames_other_profile", "frames with packets of another profile"},
    {kLink, "frames_unknown_flags", "frames with a flag that this release does not know"},
    {kLink, "frames_bad_packet_length", "frames with an impossible packet length"},
    {kLink, "frames_not_ours", "frames without our magic"},
    {kLink, "frames_sealed", "sealed frames on a link without a swarm key"},
    {kLink, "frames_without_key", "frames that are not sealed, on a link with a swarm key"},
    {kLink, "frames_other_key", "frames sealed with another swarm key"},
    {kLink, "frames_replayed", "sealed frames that were heard before, or come too late to tell"},
    {kLink, "frames_not_authentic", "sealed frames that are damaged or forged"},
    {kLink, "own_echoes", "our own frames, heard back"},
    {kLink, "send_retries", "times that the kernel's queue was full and frames were kept"},
    {kLink, "send_errors", "frames given up after an error or one second of waiting"},
    {kLink, "packets_over_mtu", "packets that fit into no frame of the link"},
    {kLink, "kernel_drops", "frames that the kernel dropped because the socket's buffer was full"},
    {kLink, "link_down_events", "times that the link went down"},
    {kLink, "airtime_us_sent", "estimated air time of the frames sent, in microseconds"},
    {kLink, "airtime_us_received", "estimated air time of the frames received, in microseconds"},
    {kLink, "beacons_sent", "frames without packets, sent because nothing else was"},
    {kLink, "overhead_padding_bytes", "bytes between frames that keep false ones from being found"},
    {kLink, "overhead_frames_withheld", "frames that must never leave, held back"},
    {kLink, "gateway_frames", "readable frames of the gateway Kilobot"},
    {kLink, "gateway_frames_unreadable", "frames of the gateway that are damaged, or none"},
    {kLink, "gateway_frames_missing", "frames missing in the gateway's count, lost on its line"},
    {kLink, "gateway_reports_dropped", "messages that the gateway had no room for, as it says"},
    {kLink, "gateway_restarts", "times that the gateway began to count again"},
    {kLink, "gateway_other_messages", "messages that are not packets of the link's profile"},
    {kLink, "uplink_texts", "lines of text from the uplink"},
    {kLink, "uplink_lines_cut", "of these, longer than 256 bytes and cut"},
    {kLink, "node_packets_forwarded", "packets sent on for others"},
    {kLink, "node_messages_sent", "whole messages sent"},
    {kLink, "frames_not_fresh",
     "sealed frames without a nonce, of a robot with check_freshness = false"},
    {kLink, "frames_not_proven", "sealed frames of robots that have not shown yet that they live"},
    {kLink, "frames_proven_later", "of these, taken once their robot had shown it"},
    {kLink, "frames_too_old", "sealed frames that were held back"},
    {kLink, "node_messages_received", "whole messages received"},
    {kLink, "node_bad_packets", "packets that contradict themselves"},
    {kLink, "node_bad_checksums", "packets with a wrong checksum"},
    {kLink, "node_unknown_channels", "packets of channels that no program here subscribes to"},
    {kLink, "node_duplicates", "copies of packets that were received already"},
    {kLink, "node_own_echoes", "our own packets, forwarded by others"},
    {kLink, "node_forward_queue_full", "packets not forwarded for want of room"},
    {kLink, "node_forwards_too_late", "packets not forwarded because they waited for too long"},
    {kLink, "node_no_memory", "long messages given up for want of room"},
    {kLink, "node_aged_out", "messages of which a packet never came"},
    {kLink, "node_contradictions", "packets that cannot be of one message"},
    {kLink, "node_id_collisions", "packets of another origin under our node id"},
    {kLink, "node_bad_origins", "messages marked as crossed whose origin cannot be read"},
    {kLink, "repairs_sent", "repair packets of this robot's messages, sent"},
    {kLink, "repairs_received", "parity packets that came"},
    {kLink, "repairs_forwarded", "parity packets sent on for others"},
    {kLink, "repairs_dropped", "repair packets given up for want of room or time"},
    {kLink, "packets_recovered", "lost packets that parity packets have made known"},
    {kLink, "neighbours_evicted", "robots left out of the neighbour table for want of room"},
    {kLink, "packets_too_far", "packets from beyond virtual_range_m"},
    {kLink, "packets_unknown_distance", "packets dropped by virtual_range_unknown"},
    {kLink, "packets_of_ghosts", "packets of simulated robots, dropped by ghosts = \"ignore\""},
};

constexpr std::string_view kDrops[] = {
    "frames_truncated",      "frames_other_version",     "frames_other_profile",
    "frames_unknown_flags",  "frames_bad_packet_length", "frames_not_ours",
    "frames_sealed",         "frames_without_key",       "frames_other_key",
    "frames_replayed",       "frames_not_authentic",     "frames_not_fresh",
    "frames_not_proven",     "frames_too_old",           "own_echoes",
    "kernel_drops",          "node_bad_packets",         "node_bad_checksums",
    "node_unknown_channels", "node_duplicates",          "node_own_echoes",
    "node_no_memory",        "node_forward_queue_full",  "node_bad_origins",
    "node_aged_out",         "node_contradictions",      "node_id_collisions",
    "packets_too_far",       "packets_unknown_distance", "packets_of_ghosts"};

}  // namespace

bool tells_a_drop(std::string_view name) {
  return std::find(std::begin(kDrops), std::end(kDrops), name) != std::end(kDrops);
}

std::span<const CounterHelp> counter_list() {
  return kCounters;
}

const CounterHelp* find_counter(CounterOwner owner, std::string_view name) {
  const auto* const found = std::find_if(
      std::begin(kCounters), std::end(kCounters),
      [&](const CounterHelp& counter) { return counter.owner == owner && counter.name == name; });
  return found == std::end(kCounters) ? nullptr : found;
}

}  // namespace swarmtalk::daemon
