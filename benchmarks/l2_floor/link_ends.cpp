#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <chrono>

#include "benchmarks/l2_floor/ends.hpp"
#include "drivers/socket/raw_l2.hpp"

namespace swarmtalk::l2_floor {
namespace {

using namespace std::chrono_literals;

drivers::RawL2Config config_of(const std::string& interface) {
  drivers::RawL2Config config;
  config.interface = interface;
  config.ethertype = kEthertype;
  return config;
}

class LinkSender final : public Sender, private drivers::LinkUser {
 public:
  explicit LinkSender(const std::string& interface) : link_(io_, config_of(interface)) {
    link_.start(*this);
  }

  void send(std::size_t message_bytes) override {
    message_bytes_ = message_bytes;
    ++waiting_;
    link_.wake();
    // A message at a time leaves at once, as from a daemon that has nothing else to do; under load
    // what has gathered shares a frame.
    if (waiting_ >= kGathered || !is_loaded_) io_.poll();
  }

  void wait_until(std::int64_t time_ns) override {
    const auto time = std::chrono::steady_clock::time_point(std::chrono::nanoseconds(time_ns));
    is_loaded_ = time <= std::chrono::steady_clock::now();
    io_.restart();
    if (is_loaded_) {
      io_.poll();
    } else {
      io_.run_until(time);
    }
    io_.restart();
  }

 private:
  static constexpr std::size_t kGathered = 32;

  std::size_t pull_packet(std::span<std::uint8_t> out) override {
    if (waiting_ == 0 || out.size() < message_bytes_) return 0;
    --waiting_;
    stamp(out);
    return message_bytes_;
  }
  std::size_t next_packet_bytes() override { return waiting_ == 0 ? 0 : message_bytes_; }
  void on_packet(std::span<const std::uint8_t>, const drivers::FrameReception&) override {}
  frame::FrameHeader frame_header() override { return {}; }

  boost::asio::io_context io_{1};
  drivers::RawL2Link link_;
  std::size_t message_bytes_ = kSmallestMessageBytes;
  std::size_t waiting_ = 0;
  bool is_loaded_ = false;
};

class LinkReceiver final : public Receiver, private drivers::LinkUser {
 public:
  explicit LinkReceiver(const std::string& interface) : link_(io_, config_of(interface)) {
    link_.start(*this);
  }

  void receive(const std::function<bool(std::span<const std::uint8_t>)>& on_message) override {
    on_message_ = &on_message;
    io_.restart();
    while (on_message_ != nullptr && io_.run_one_for(5s) > 0) {
    }
  }

 private:
  std::size_t pull_packet(std::span<std::uint8_t>) override { return 0; }
  std::size_t next_packet_bytes() override { return 0; }
  void on_packet(std::span<const std::uint8_t> packet, const drivers::FrameReception&) override {
    if (on_message_ != nullptr && !(*on_message_)(packet)) on_message_ = nullptr;
  }
  frame::FrameHeader frame_header() override { return {}; }

  boost::asio::io_context io_{1};
  drivers::RawL2Link link_;
  const std::function<bool(std::span<const std::uint8_t>)>* on_message_ = nullptr;
};

}  // namespace

std::unique_ptr<Sender> open_link_sender(const std::string& interface) {
  return std::make_unique<LinkSender>(interface);
}

std::unique_ptr<Receiver> open_link_receiver(const std::string& interface) {
  return std::make_unique<LinkReceiver>(interface);
}

}  // namespace swarmtalk::l2_floor
