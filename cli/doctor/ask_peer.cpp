#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <memory>
#include <random>

#include "cli/common/deadline.hpp"
#include "cli/common/operator.hpp"
#include "cli/common/pong.hpp"
#include "cli/doctor/peer.hpp"
#include "frame/air_frame.hpp"

namespace swarmtalk::cli::doctor {
namespace {

constexpr auto kLastAnswers = std::chrono::milliseconds(700);  // after the last question
constexpr int kReachTimeoutMs = 4000;
constexpr const char* kProbePort = "22";  // open or refused, both are answers

double ms_of(Clock::time_point time) {
  return std::chrono::duration<double, std::milli>(time.time_since_epoch()).count();
}

class Questioner {
 public:
  Questioner(Client& client, const PeerArguments& arguments, PeerFacts& facts)
      : client_(client), arguments_(arguments), facts_(facts), run_(std::random_device{}()) {
    Channel channel = client.channel("ping");
    publisher_ = channel.publisher([](const Status&) {}, Sending::newest(4));
    subscriber_ = channel.subscriber([this](const Message& message) { hear(message); });
  }

  Status run() {
    if (const Status status = publisher_.status(); !status) return status;
    if (const Status status = subscriber_.status(); !status) return status;
    auto next = Clock::now();
    for (std::uint32_t i = 1; i <= arguments_.questions && caught_signal() == 0; ++i) {
      asked_at_.push_back(Clock::now());
      ++facts_.asked;
      // One hop: what others pass on says nothing about the two.
      const Status status =
          publisher_.send("ping " + std::to_string(run_) + " " + std::to_string(i) + " " +
                              std::to_string(arguments_.robot) + " 0",
                          0);
      if (!status && status.code() != StatusCode::kBusy) return status;
      next = after(next, seconds(arguments_.period_s));
      wait_until(next);
    }
    wait_until(Clock::now() + kLastAnswers);
    return Status();
  }

 private:
  void wait_until(Clock::time_point end) {
    while (caught_signal() == 0 && Clock::now() < end) client_.run_once(end - Clock::now());
  }

  void hear(const Message& message) {
    const auto pong = read_pong(message.payload);
    if (message.sender != arguments_.robot || !pong || pong->run != run_) return;
    if (pong->sequence == 0 || pong->sequence > asked_at_.size()) return;
    const Clock::time_point at = message.received_at.value_or(Clock::now());
    ++facts_.answered;
    facts_.heard_there = std::max<std::uint64_t>(facts_.heard_there, pong->heard);
    facts_.arrivals_ms.push_back(ms_of(at));
    facts_.round_trips_ms.push_back(ms_of(at) - ms_of(asked_at_[pong->sequence - 1]));
  }

  Client& client_;
  const PeerArguments& arguments_;
  PeerFacts& facts_;
  const std::uint32_t run_;
  std::vector<Clock::time_point> asked_at_;
  Publisher publisher_;
  Subscriber subscriber_;
};

/// The frames of the robot that our daemon captured meanwhile.
void count_frames(OperatorConnection& daemon, std::uint32_t robot, PeerFacts& facts) {
  constexpr int kMostFrames = 20000;
  constexpr std::size_t kEthernetHeader = 14;
  ipc::Envelope envelope;
  for (int i = 0; i < kMostFrames; ++i) {
    envelope.Clear();
    if (!daemon.next(envelope, std::chrono::milliseconds(0))) return;
    if (!envelope.has_captured() || envelope.captured().sent()) continue;
    const ipc::Captured& captured = envelope.captured();
    const std::string& bytes = captured.frame();
    frame::Frame frame;
    const auto result =
        frame::parse({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, frame);
    const bool is_read = result == frame::ParseResult::kOk || result == frame::ParseResult::kSealed;
    if (!is_read || frame.header.node != robot) continue;
    ++facts.frames;
    facts.link = captured.link();
    const std::string& header = captured.ethernet_header();
    if (header.size() != kEthernetHeader) continue;
    facts.is_captured = true;
    const bool is_to_all = (static_cast<unsigned char>(header[0]) & 1) != 0;
    ++(is_to_all ? facts.broadcast_frames : facts.unicast_frames);
  }
}

void ask_signal(OperatorConnection& daemon, std::uint32_t robot, PeerFacts& facts) {
  ipc::Envelope question;
  ipc::Envelope answer;
  question.mutable_get_neighbours();
  for (int i = 0; i < 1000 && !answer.has_neighbours(); ++i) {
    if (!daemon.request(question, answer)) return;
  }
  for (const ipc::Neighbour& each : answer.neighbours().neighbours()) {
    if (each.node_id() == robot && each.has_signal_dbm()) facts.signal_dbm = each.signal_dbm();
  }
}

struct AddressFreer {
  void operator()(addrinfo* list) const { ::freeaddrinfo(list); }
};

}  // namespace

Status test_peer(const Common& common, const PeerArguments& arguments, PeerFacts& facts) {
  facts.robot = arguments.robot;
  OperatorConnection watching;
  if (const Status status = watching.open(common.socket_path); !status) return status;
  ipc::Envelope question;
  ipc::Envelope answer;
  question.mutable_capture();
  if (const Status status = watching.request(question, answer); !status) return status;
  Client client = make_client(common);
  if (const Status status = client.connect(); !status) return status;
  stop_on_signals(client);
  Questioner questioner(client, arguments, facts);
  if (const Status status = questioner.run(); !status) return status;
  count_frames(watching, arguments.robot, facts);
  OperatorConnection asking;
  if (asking.open(common.socket_path)) ask_signal(asking, arguments.robot, facts);
  // Where the ping is answered, its address has nothing to tell.
  if (facts.answered == 0 && !arguments.address.empty()) {
    facts.is_reached = is_reached(arguments.address);
    if (!facts.is_reached) {
      return Status(StatusCode::kBadArgument,
                    "--address " + arguments.address + " is not an address or known name");
    }
  }
  return Status();
}

std::optional<bool> is_reached(const std::string& address) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (::getaddrinfo(address.c_str(), kProbePort, &hints, &found) != 0) return std::nullopt;
  const std::unique_ptr<addrinfo, AddressFreer> list(found);
  const int socket =
      ::socket(list->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, IPPROTO_TCP);
  if (socket < 0) return std::nullopt;
  int error = ::connect(socket, list->ai_addr, list->ai_addrlen) == 0 ? 0 : errno;
  if (error == EINPROGRESS) {
    pollfd waiting{socket, POLLOUT, 0};
    socklen_t size = sizeof error;
    if (::poll(&waiting, 1, kReachTimeoutMs) != 1) {
      error = ETIMEDOUT;
    } else {
      ::getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &size);
    }
  }
  ::close(socket);
  return error == 0 || error == ECONNREFUSED || error == ECONNRESET;
}

}  // namespace swarmtalk::cli::doctor
