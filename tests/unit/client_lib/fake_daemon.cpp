#include "tests/unit/client_lib/fake_daemon.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

namespace swarmtalk::test {

std::string test_socket_path() {
  std::string pattern = (std::filesystem::temp_directory_path() / "swarmtalk-XXXXXX").string();
  return std::string(::mkdtemp(pattern.data())) + "/d.sock";
}

FakeDaemon::FakeDaemon(std::string path)
    : path_(std::move(path)), wake_fd_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  listen_here();
  thread_ = std::thread([this] { loop(); });
}

FakeDaemon::~FakeDaemon() {
  on_thread([this] { is_ending_ = true; });
  thread_.join();
  close_all();
  ::close(wake_fd_);
  std::filesystem::remove_all(std::filesystem::path(path_).parent_path());
}

void FakeDaemon::listen_here() {
  ::unlink(path_.c_str());
  listen_fd_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path_.c_str(), sizeof(address.sun_path) - 1);
  if (::bind(listen_fd_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) != 0 ||
      ::listen(listen_fd_, 16) != 0) {
    std::perror("fake daemon");
    std::abort();
  }
}

void FakeDaemon::close_all() {
  if (listen_fd_ >= 0) ::close(listen_fd_);
  listen_fd_ = -1;
  for (auto& peer : peers_) ::close(peer->fd);
  peers_.clear();
}

void FakeDaemon::kill() {
  on_thread([this] { close_all(); });
}

void FakeDaemon::restart() {
  on_thread([this] { listen_here(); });
}

void FakeDaemon::on_thread(const std::function<void()>& task) {
  std::unique_lock<std::mutex> lock(mutex_);
  task_ = &task;
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t count = ::write(wake_fd_, &one, sizeof(one));
  done_.wait(lock, [this] { return task_ == nullptr; });
}

void FakeDaemon::loop() {
  while (!is_ending_) {
    std::vector<pollfd> descriptors{{wake_fd_, POLLIN, 0}, {listen_fd_, POLLIN, 0}};
    for (auto& peer : peers_) descriptors.push_back({peer->fd, POLLIN, 0});
    ::poll(descriptors.data(), descriptors.size(), -1);
    for (std::size_t i = 0; i < peers_.size(); ++i) {
      if (descriptors[i + 2].revents != 0) read_peer(*peers_[i]);
    }
    std::erase_if(peers_, [](const auto& peer) { return peer->fd < 0; });
    if ((descriptors[1].revents & POLLIN) != 0) {
      const int fd = ::accept4(listen_fd_, nullptr, nullptr, SOCK_CLOEXEC);
      if (fd >= 0) peers_.push_back(std::make_unique<Peer>(Peer{fd, {}, {}}));
      if (fd >= 0 && refuse_clients.code() != 0) {
        ipc::Envelope refusal;
        *refusal.mutable_failure() = refuse_clients;
        reply(*peers_.back(), refusal);
        ::close(fd);
        peers_.pop_back();
      }
    }
    // A task runs only after the poll that saw its bell: what was sent before it has been read.
    if (descriptors[0].revents == 0) continue;
    const std::lock_guard<std::mutex> lock(mutex_);
    std::uint64_t value = 0;
    [[maybe_unused]] const ssize_t count = ::read(wake_fd_, &value, sizeof(value));
    if (task_ != nullptr) {
      (*task_)();
      task_ = nullptr;
      done_.notify_all();
    }
  }
}

/// 7 of the first that is asked for, then 8, and so on.
std::uint32_t FakeDaemon::number_of(const ipc::Channel& channel) {
  const auto next = static_cast<std::uint32_t>(7 + numbers_.size());
  const std::string asked = channel.name() + '#' + std::to_string(channel.number());
  return numbers_.emplace(asked, next).first->second;
}

void FakeDaemon::read_peer(Peer& peer) {
  const auto room = peer.reader.prepare(64 * 1024);
  const ssize_t count = ::recv(peer.fd, room.data(), room.size(), 0);
  if (count <= 0) {
    ::close(peer.fd);
    peer.fd = -1;
    return;
  }
  ++reads_;
  peer.reader.commit(static_cast<std::size_t>(count));
  ipc::Envelope envelope;
  while (peer.reader.next(envelope) == ipc::ReadResult::kEnvelope) handle(peer, envelope);
}

void FakeDaemon::handle(Peer& peer, const ipc::Envelope& envelope) {
  received_.push_back(envelope);
  std::vector<ipc::Envelope> said = says ? says(envelope) : std::vector<ipc::Envelope>();
  if (!said.empty()) said[0].set_request_id(envelope.request_id());
  for (ipc::Envelope& each : said) reply(peer, each);
  if (!said.empty()) return;
  ipc::Envelope answer;
  if (envelope.request_id() != 0) answer.set_request_id(envelope.request_id());
  if (envelope.has_hello()) {
    if (!says_hello) return;
    ipc::Hello& hello = *answer.mutable_hello();
    hello.set_major(major);
    hello.set_name("fake 1.0");
    hello.set_node_id(42);
  } else if (envelope.has_publish()) {
    if (!answers_publish) return;
    if (refuse_messages_.code() != 0) {
      ipc::Failure& failure = *answer.mutable_failure();
      failure = refuse_messages_;
      failure.set_publisher_id(envelope.publish().publisher_id());
      failure.set_publish_number(envelope.publish().publish_number());
      return reply(peer, answer);
    }
    answer.mutable_sent()->set_publisher_id(envelope.publish().publisher_id());
    answer.mutable_sent()->set_publish_number(envelope.publish().publish_number());
  } else if (!answers_requests) {
    return;
  } else if (refuse_channels.code() != 0 &&
             (envelope.has_subscribe() || envelope.has_advertise())) {
    *answer.mutable_failure() = refuse_channels;
  } else if (envelope.has_subscribe()) {
    peer.subscriptions.push_back(++last_id_);
    answer.mutable_subscribed()->set_subscription_id(last_id_);
    answer.mutable_subscribed()->set_channel(number_of(envelope.subscribe().channel()));
  } else if (envelope.has_advertise()) {
    ipc::Advertised& advertised = *answer.mutable_advertised();
    advertised.set_publisher_id(++last_id_);
    advertised.set_channel(number_of(envelope.advertise().channel()));
    advertised.set_max_message_bytes(max_message_bytes);
    advertised.set_max_ttl(5);
    if (is_timestamped) advertised.set_timestamped(*is_timestamped);
  } else if (envelope.has_get_status()) {
    answer.mutable_status()->set_version("fake");
    answer.mutable_status()->set_node_id(42);
  } else if (envelope.has_get_pose()) {
    answer.mutable_pose()->set_x_m(1);
    answer.mutable_pose()->set_y_m(2);
    answer.mutable_pose()->set_theta_rad(3);
  } else {
    answer.mutable_done();
  }
  reply(peer, answer);
}

void FakeDaemon::reply(Peer& peer, ipc::Envelope& envelope) {
  std::string bytes;
  ipc::append_frame(envelope, bytes);
  [[maybe_unused]] const ssize_t count = ::send(peer.fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
}

void FakeDaemon::deliver(const ipc::Deliver& deliver) {
  on_thread([&] {
    for (auto& peer : peers_) {
      for (const std::uint32_t id : peer->subscriptions) {
        ipc::Envelope envelope;
        *envelope.mutable_deliver() = deliver;
        envelope.mutable_deliver()->set_subscription_id(id);
        reply(*peer, envelope);
      }
    }
  });
}

void FakeDaemon::deliver(const std::string& payload) {
  ipc::Deliver body;
  body.set_payload(payload);
  deliver(body);
}

void FakeDaemon::refuse_messages(ipc::ErrorCode code, const std::string& text) {
  on_thread([&] {
    refuse_messages_.set_code(code);
    refuse_messages_.set_text(text);
  });
}

void FakeDaemon::send_raw(const std::string& bytes) {
  on_thread([&] {
    for (auto& peer : peers_) {
      [[maybe_unused]] const ssize_t count =
          ::send(peer->fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    }
  });
}

void FakeDaemon::answer_publish() {
  on_thread([&] {
    for (auto entry = received_.rbegin(); entry != received_.rend(); ++entry) {
      if (!entry->has_publish()) continue;
      ipc::Envelope envelope;
      envelope.mutable_sent()->set_publisher_id(entry->publish().publisher_id());
      envelope.mutable_sent()->set_publish_number(entry->publish().publish_number());
      for (auto& peer : peers_) reply(*peer, envelope);
      return;
    }
  });
}

std::vector<ipc::Envelope> FakeDaemon::received() {
  std::vector<ipc::Envelope> copy;
  on_thread([&] { copy = received_; });
  return copy;
}

int FakeDaemon::count(const std::function<bool(const ipc::Envelope&)>& matches) {
  const auto envelopes = received();
  return static_cast<int>(std::count_if(envelopes.begin(), envelopes.end(), matches));
}

int FakeDaemon::reads() {
  int copy = 0;
  on_thread([&] { copy = reads_; });
  return copy;
}

}  // namespace swarmtalk::test
