// A whole robot for fuzz targets, without a network: one station whose packets come by hand, and
// clients on socket pairs. Whatever the daemon writes to a client is read by the client's parser,
// and every string in it is text.
#pragma once

#include <fcntl.h>
#include <google/protobuf/descriptor.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "daemon/operator/status_report.hpp"
#include "daemon/session/clients.hpp"
#include "daemon/station/node_station.hpp"
#include "ipc/framing.hpp"
#include "ipc/message_frames.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#include "text/plain.hpp"

namespace swarmtalk::fuzz {

using namespace swarmtalk::daemon;

constexpr std::uint16_t kChannel = 1;

class HandLink final : public drivers::Link {
 public:
  void start(drivers::LinkUser& user) override { user_ = &user; }
  void wake() override {}
  bool is_up() const override { return true; }
  std::string state() const override { return "up"; }
  std::string type() const override { return "hand"; }
  std::string device() const override { return "\xff\x1b"; }
  drivers::Counters counters() const override { return {}; }
  void hand_up(std::span<const std::uint8_t> packet) {
    drivers::FrameReception frame;
    frame.transmitter = 9;
    frame.received_at = std::chrono::steady_clock::now();
    user_->on_packet(packet, frame);
  }

 private:
  drivers::LinkUser* user_ = nullptr;
};

/// Every string of a message that was written by the daemon is plain text.
inline void check_strings(const google::protobuf::Message& message) {
  const auto* reflection = message.GetReflection();
  std::vector<const google::protobuf::FieldDescriptor*> fields;
  reflection->ListFields(message, &fields);
  for (const auto* field : fields) {
    const int count = field->is_repeated() ? reflection->FieldSize(message, field) : 1;
    for (int i = 0; i < count; ++i) {
      if (field->type() == google::protobuf::FieldDescriptor::TYPE_STRING) {
        const std::string value = field->is_repeated()
                                      ? reflection->GetRepeatedString(message, field, i)
                                      : reflection->GetString(message, field);
        if (!text::is_plain_text(value)) std::abort();
      } else if (field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_MESSAGE) {
        check_strings(field->is_repeated() ? reflection->GetRepeatedMessage(message, field, i)
                                           : reflection->GetMessage(message, field));
      }
    }
  }
}

/// With one program of its own, which subscribes to kChannel.
class Robot {
 public:
  Robot() {
    hub_.add(station_);
    station_.start();
    status_.set_clients(clients_);
    ours_ = connect();
    ipc::Envelope request;
    request.mutable_hello()->set_major(ipc::kProtocolMajor);
    send(ours_, request);
    request.Clear();
    request.mutable_subscribe()->mutable_channel()->set_number(kChannel);
    send(ours_, request);
    step();
  }
  ~Robot() {
    clients_.close_all("the run ends");
    step();
    for (const int end : ends_) close(end);
  }

  void crossed(std::span<const std::uint8_t> payload) {
    using Wire = core::Wire<core::Wifi>;
    std::vector<std::uint8_t> packet(Wire::kHeaderBytes + payload.size());
    Wire::Header header{};
    header.node = 9;
    header.message = ++number_;
    header.end = true;
    header.channel = kChannel;
    header.size = static_cast<std::uint16_t>(payload.size());
    header.crossed_gateway = true;
    Wire::encode(header, packet.data());
    std::memcpy(packet.data() + Wire::kHeaderBytes, payload.data(), payload.size());
    link_->hand_up(packet);
  }
  void any_packet(std::span<const std::uint8_t> packet) { link_->hand_up(packet); }
  void program(const std::string& name, bool is_channel) {
    const int end = connect();
    ipc::Envelope request;
    request.mutable_hello()->set_major(ipc::kProtocolMajor);
    if (!is_channel) request.mutable_hello()->set_name(text::plain(name));
    send(end, request);
    request.Clear();
    if (is_channel) {
      request.mutable_subscribe()->mutable_channel()->set_name(name);
    } else {
      request.mutable_get_status();
    }
    send(end, request);
    step();
    ipc::FrameReader reader;
    read(end, reader);
  }
  /// What the subscriber and a program that asks for the status are written.
  void check() {
    step();
    ipc::Envelope request;
    request.mutable_get_status();
    send(ours_, request);
    step();
    ipc::FrameReader reader;
    if (!read(ours_, reader)) std::abort();
  }

  /// @return a client's end; closed with the robot, or by hang_up()
  int connect() {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0) std::abort();
    fcntl(ends[0], F_SETFL, O_NONBLOCK);
    clients_.add(ends[0]);
    ends_.push_back(ends[1]);
    return ends[1];
  }
  void step() {
    io_.restart();
    io_.poll();
  }
  static void send(int end, const ipc::Envelope& envelope) {
    std::string bytes;
    if (!ipc::append_frame(envelope, bytes)) return;
    ::send(end, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }
  /// @param reader  has what was read of this end before. @return whether the daemon is still there
  static bool read(int end, ipc::FrameReader& reader) {
    for (;;) {
      const auto room = reader.prepare(65536);
      const ssize_t got = recv(end, room.data(), room.size(), MSG_DONTWAIT);
      if (got == 0) return false;
      if (got < 0) break;
      reader.commit(static_cast<std::size_t>(got));
    }
    for (;;) {
      ipc::Envelope envelope;
      const ipc::ReadResult result = reader.next(envelope);
      if (result == ipc::ReadResult::kMalformed) std::abort();
      if (result != ipc::ReadResult::kEnvelope) return true;
      check_strings(envelope);
    }
  }
  void hang_up(int end) {
    close(end);
    ends_.erase(std::find(ends_.begin(), ends_.end(), end));
    step();
  }
  /// Clients that are served.
  std::size_t clients() const { return clients_.size(); }

 private:
  boost::asio::io_context io_;
  ChannelTable names_{{}};
  LimitsConfig limits_;
  DaemonCounters counters_;
  NodeIdentity identity_{5};
  PoseKeeper poses_{NodeConfig{}};
  Hub hub_{names_, limits_, counters_, identity_};
  HandLink* link_ = new HandLink;
  NodeStation<core::Wifi> station_{"w",
                                   {frame::ProfileId::kWifi, "wifi"},
                                   std::unique_ptr<drivers::Link>(link_),
                                   identity_,
                                   poses_,
                                   hub_};
  StatusReport status_{hub_, poses_, identity_, counters_, "\xff.toml"};
  Clients clients_{io_, hub_, poses_, limits_, counters_, status_};
  std::vector<int> ends_;
  int ours_ = -1;
  std::uint32_t number_ = 0;
};

}  // namespace swarmtalk::fuzz
