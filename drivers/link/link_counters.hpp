// What every link counts. One struct, so that a name is spelled in one place and each link reports
// all of them, in one order. Incremented by the links on the io_context's thread.
#pragma once

#include <cstdint>

#include "drivers/link/link.hpp"

namespace swarmtalk::drivers {

struct LinkCounters {
  std::uint64_t frames_sent = 0;      // handed to the kernel (replay: written)
  std::uint64_t frames_received = 0;  // readable and of our profile
  std::uint64_t packets_sent = 0;
  std::uint64_t packets_received = 0;
  std::uint64_t bytes_sent = 0;      // of air frames, without Ethernet, IP and UDP headers
  std::uint64_t bytes_received = 0;  // the same, without padding
  // Dropped on reception, by cause (docs/wire-format.md).
  std::uint64_t frames_truncated = 0;
  std::uint64_t frames_other_version = 0;
  std::uint64_t frames_other_profile = 0;
  std::uint64_t frames_unknown_flags = 0;
  std::uint64_t frames_bad_packet_length = 0;  // its leading packets were kept
  std::uint64_t frames_not_ours = 0;           // not our magic
  std::uint64_t frames_sealed = 0;             // with a swarm key, and we have none
  std::uint64_t frames_without_key = 0;        // not sealed, and we have a key
  std::uint64_t frames_other_key = 0;          // sealed with another
  std::uint64_t frames_not_fresh = 0;          // sealed, without a nonce
  std::uint64_t frames_replayed = 0;           // heard before, or too late to tell
  std::uint64_t frames_not_proven = 0;         // of a session that has not shown that it lives
  std::uint64_t frames_proven_later = 0;       // of these: taken when it had, and received
  std::uint64_t frames_too_old = 0;            // held back for too long
  std::uint64_t frames_not_authentic = 0;      // damaged, or forged
  std::uint64_t frames_tagged = 0;             // for another VLAN than this interface's
  std::uint64_t own_echoes = 0;                // our own frames, heard back
  // On the way out.
  std::uint64_t send_retries = 0;      // the kernel's queue was full; the frames were kept
  std::uint64_t send_errors = 0;       // frames given up, after an error or one second of waiting
  std::uint64_t packets_over_mtu = 0;  // packets that fit into no frame of this link, dropped
  std::uint64_t kernel_drops = 0;      // received, but our socket's buffer was full
  std::uint64_t link_down_events = 0;
  std::uint64_t airtime_us_sent = 0;  // estimates, where the radio's rate is configured
  std::uint64_t airtime_us_received = 0;
  std::uint64_t beacons_sent = 0;  // of frames_sent: frames without packets

  Counters list() const;
};

}  // namespace swarmtalk::drivers
