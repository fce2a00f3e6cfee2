// SocketLink: what the links over a socket share. Drains the socket 64 frames a turn, builds frames
// of what waits when the pacer allows, keeps frames that the kernel does not take, and keeps score
// of whether the link is up. RawL2Link and UdpLink add how their medium is opened and watched.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "drivers/link/airtime.hpp"
#include "drivers/link/beacon_timer.hpp"
#include "drivers/link/frame_tap.hpp"
#include "drivers/link/framer.hpp"
#include "drivers/link/link.hpp"
#include "drivers/link/link_counters.hpp"
#include "drivers/link/link_seal.hpp"
#include "drivers/link/link_state.hpp"
#include "drivers/link/own_echoes.hpp"
#include "drivers/link/pacer.hpp"
#include "drivers/link/unreadable_frames.hpp"
#include "drivers/link/wake_timer.hpp"
#include "drivers/socket/interface_watch.hpp"
#include "drivers/socket/receive_batch.hpp"
#include "drivers/socket/transmit_queue.hpp"
#include "loop/loop.hpp"
#include "loop/timer.hpp"

namespace swarmtalk::drivers {

/// What to do about an interface, behind the state that a link has without it.
inline constexpr const char* kGoneRemedy = " (ip link lists those there are)";

class SocketLink : public Link, public Tappable {
 public:
  void start(LinkUser& user) override;
  void wake() override;
  void wake_at(MonotonicTime time) override { wake_timer_.arm(time); }
  void set_tap(FrameTap* tap) override { tap_ = tap; }
  void set_pacing(const PacerConfig& pacing) override;
  void set_beacon(std::chrono::milliseconds interval) override { beacon_.set_interval(interval); }
  void set_air_rate(double rate_mbps) override { airtime_.set_rate(rate_mbps, counters_); }
  void set_key(std::shared_ptr<const frame::SwarmKey> key) override;
  void set_also_key(std::shared_ptr<const frame::SwarmKey> key) override {
    seal_.set_also_key(std::move(key));
  }
  void set_freshness(bool is_on) override { seal_.set_freshness(is_on); }
  std::size_t packet_limit_bytes() const override {
    return frame::max_packet_bytes(frame_limit_bytes_, is_sealed());
  }
  bool is_up() const override { return state_.is_up(); }
  std::string state() const override { return state_.text() + seal_.remark(); }
  Counters counters() const override;
  std::string missing() const override { return missing_; }

 protected:
  SocketLink(boost::asio::io_context& io, frame::ProfileId profile, std::size_t max_packet_bytes,
             const PacerConfig& pacer, std::size_t network_header_bytes = 0);

  /// Takes over an open socket, in the constructor of the derived class. Without a sending socket
  /// the receiving one sends.
  void use_receive_socket(int socket);
  void use_send_socket(int socket);

  /// In the constructor of the derived class: its interface is not there yet.
  /// @param error  missing()
  void wait_for_interface(const std::string& interface, const std::string& error);

  /// The interface is not there, or not any more.
  void set_gone(const std::string& interface);

  /// Whether it came through this interface and is for another network on the same cable.
  virtual bool is_of_another_vlan(const Datagram&) const { return false; }

  /// Takes the medium's header off a datagram. @return none: it is our own, heard back
  virtual std::optional<std::span<const std::uint8_t>> air_frame(const Datagram& datagram) = 0;

  /// The transmitter's address in a datagram that air_frame() has looked at; 0: not known.
  virtual std::uint64_t hardware_of(const Datagram& datagram) const = 0;

  /// Bytes in front of the air frame in a datagram.
  virtual std::size_t medium_header_bytes() const { return 0; }

  /// Looks at the medium again and calls set_state(): at the start, after each change of an
  /// interface, and after an error that may mean one.
  virtual void refresh() = 0;

  /// Frames that the kernel has dropped since the link was opened.
  virtual std::uint64_t kernel_drops() const = 0;

  /// A link that comes up transmits what waits.
  void set_state(bool is_up, const std::string& text);

  /// Longest air frame that the medium takes, and the longest datagram to expect from it.
  void set_limits(std::size_t frame_bytes, std::size_t datagram_bytes);

  /// " (its MTU ...)" when the longest packet does not fit into a frame, else empty.
  std::string mtu_remark() const;

  /// Of the address from which our own frames leave, as hardware_of() has it.
  void set_own_hardware(std::uint64_t hardware) { own_hardware_ = hardware; }
  const OwnEchoes& echoes() const { return echoes_; }

  LinkUser* user() const { return user_; }
  bool is_sealed() const { return seal_.is_sealed(); }
  std::chrono::microseconds forward_jitter() const {
    return std::chrono::duration_cast<std::chrono::microseconds>(pacer_.longest_forward_jitter());
  }
  double air_rate_mbps() const { return airtime_.rate_mbps(); }
  const InterfaceWatch& watch() const { return watch_; }
  TransmitQueue& transmit_queue() { return queue_; }

 private:
  void on_events(std::uint32_t events);
  void on_writable();
  void receive();
  void receive(const Datagram& datagram);
  void flush();
  bool fill_queue(MonotonicTime now);
  void transmit(MonotonicTime now);
  void on_send_error(int error, MonotonicTime now);
  void wait_writable();
  bool send_frame_without_packets(MonotonicTime now);
  bool speak(MonotonicTime now);
  void flush_after(std::chrono::steady_clock::duration delay);
  bool ends_forward_wait();

  InterfaceWatch watch_;
  std::size_t max_packet_bytes_;
  Pacer pacer_;
  FrameBuilder builder_;
  FrameReceiver receiver_;
  ReceiveBatch batch_;
  TransmitQueue queue_;
  LinkCounters counters_;
  UnreadableFrames unreadable_;
  AirtimeMeter airtime_;
  LinkUser* user_ = nullptr;
  FrameTap* tap_ = nullptr;

  loop::Descriptor receive_socket_;
  loop::Descriptor send_socket_;  // none: the receiving one
  loop::Deferred flush_;          // at the end of a turn
  loop::Timer timer_;             // pacing, and short waits after a full queue

  WakeTimer wake_timer_;

  BeaconTimer beacon_;
  LinkSeal seal_;

  OwnEchoes echoes_;
  std::uint64_t own_hardware_ = 0;  // 0: not known
  LinkState state_;
  std::string missing_;
  std::string waiting_;  // the state until its interface has come; empty: it has been there
  std::uint64_t kernel_drops_ = 0;  // before the datagram in hand
  std::size_t frame_limit_bytes_ = 0;
  std::size_t frames_at_once_ = TransmitQueue::kFrames;  // fewer after the kernel's queue was full
  bool is_forward_wait_ = false;  // the armed timer is for a frame of others' packets
  bool is_filling_ = false;       // what wakes us meanwhile is pulled as well
  bool is_waiting_writable_ = false;
  MonotonicTime last_error_log_{};
};

}  // namespace swarmtalk::drivers
