// A client that writes through the ring which the daemon shares with it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/capability.h>
#include <linux/sockios.h>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>

#include <algorithm>
#include <chrono>

#include "ipc/byte_ring.hpp"
#include "ipc/pass_descriptor.hpp"
#include "tests/support/patience.hpp"
#include "tests/unit/daemon/session/session_harness.hpp"

namespace swarmtalk::daemon {
namespace {

using testing::HasSubstr;

std::string frame(const ipc::Envelope& envelope) {
  std::string bytes;
  EXPECT_TRUE(ipc::append_frame(envelope, bytes));
  return bytes;
}

ipc::Envelope publication(std::uint32_t publisher, std::uint64_t number, std::size_t size_bytes) {
  ipc::Envelope envelope;
  envelope.mutable_publish()->set_publisher_id(publisher);
  envelope.mutable_publish()->set_publish_number(number);
  envelope.mutable_publish()->set_payload(std::string(size_bytes, 'p'));
  return envelope;
}

/// As if other processes of this user had many descriptors on their way, and this one no privilege
/// to have more: no descriptor can be sent while it lives.
class NoMoreDescriptorsOnTheirWay {
 public:
  NoMoreDescriptorsOnTheirWay() {
    EXPECT_EQ(getrlimit(RLIMIT_NOFILE, &limit_), 0);
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends_), 0);
    set_capabilities(0);
    const rlimit few{kFew, limit_.rlim_max};
    EXPECT_EQ(setrlimit(RLIMIT_NOFILE, &few), 0);
    ssize_t sent = 1;
    for (rlim_t i = 0; i < 2 * kFew && sent == 1; ++i) {
      sent = ipc::send_with_descriptor(ends_[0], "x", 1, ends_[0]);
    }
    EXPECT_TRUE(sent < 0 && errno == ETOOMANYREFS) << std::strerror(errno);
  }
  NoMoreDescriptorsOnTheirWay(const NoMoreDescriptorsOnTheirWay&) = delete;
  ~NoMoreDescriptorsOnTheirWay() {
    ::close(ends_[0]);
    ::close(ends_[1]);
    setrlimit(RLIMIT_NOFILE, &limit_);
    set_capabilities(~0u);
  }

 private:
  static constexpr rlim_t kFew = 60;

  /// Of those that are permitted.
  static void set_capabilities(std::uint32_t effective) {
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    __user_cap_data_struct sets[2];
    EXPECT_EQ(syscall(SYS_capget, &header, sets), 0);
    for (auto& set : sets) set.effective = set.permitted & effective;
    EXPECT_EQ(syscall(SYS_capset, &header, sets), 0);
  }

  rlimit limit_{};
  int ends_[2];
};

class SessionRing : public SessionTest {
 protected:
  /// Connects and says hello, asking for the ring. @return the daemon's hello
  ipc::Hello greet() {
    int ends[2];
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
    fcntl(ends[0], F_SETFL, O_NONBLOCK);
    clients_.add(ends[0]);
    socket = ends[1];
    peer = std::make_unique<TestPeer>(socket);
    ipc::Envelope hello;
    hello.mutable_hello()->set_major(ipc::kProtocolMajor);
    hello.mutable_hello()->add_features("something newer");
    hello.mutable_hello()->add_features(ipc::kRingFeature);
    peer->send(hello);
    step();
    char bytes[4096];
    int descriptor = -1;
    const ssize_t got = ipc::receive_with_descriptor(socket, bytes, sizeof bytes, descriptor);
    ipc::Envelope reply;
    EXPECT_GT(got, 4);
    EXPECT_TRUE(reply.ParseFromArray(bytes + 4, static_cast<int>(got) - 4));
    if (descriptor >= 0) {
      kept_descriptor = ::dup(descriptor);
      ipc::RingMemory memory = ipc::RingMemory::adopt(descriptor);
      EXPECT_TRUE(memory.is_valid());
      header = &memory.header();
      ring.emplace(std::move(memory));
    }
    return reply.hello();
  }
  /// As a client does: the bell only for a daemon that sleeps. @return whether it was rung
  bool write(const std::string& bytes) {
    EXPECT_EQ(ring->write(bytes), bytes.size());
    return ring_bell();
  }
  bool ring_bell() {
    if (!ring->take_sleeping_reader()) return false;
    peer->send_bytes(std::string(1, static_cast<char>(ipc::kBell)));
    return true;
  }
  std::uint32_t advertise_with_queue(std::uint32_t queue) {
    ipc::Envelope request;
    request.set_request_id(1);
    request.mutable_advertise()->mutable_channel()->set_name("hello");
    request.mutable_advertise()->set_queue(queue);
    write(frame(request));
    step();
    const auto replies = peer->receive();
    EXPECT_EQ(replies.size(), 1u);
    return replies.at(0).advertised().publisher_id();
  }

  ~SessionRing() override {
    if (kept_descriptor >= 0) ::close(kept_descriptor);
  }

  int socket = -1;
  int kept_descriptor = -1;  // of the ring's memory
  std::unique_ptr<TestPeer> peer;
  ipc::RingHeader* header = nullptr;
  std::optional<ipc::RingWriter> ring;
};

TEST_F(SessionRing, IsOfferedToWhoAsks) {
  EXPECT_THAT(greet().features(), testing::ElementsAre(ipc::kRingFeature));
  EXPECT_TRUE(ring);
}

TEST_F(SessionRing, IsNotOfferedToOthers) {
  auto plain = connect();
  plain->hello();
  step();
  EXPECT_EQ(plain->receive().at(0).hello().features_size(), 0);
}

TEST_F(SessionRing, IsNotOfferedWhenTheConfigurationSaysNone) {
  limits_.ring_bytes = 0;
  EXPECT_EQ(greet().features_size(), 0);
  EXPECT_FALSE(ring);
  ipc::Envelope request;
  request.set_request_id(9);
  request.mutable_get_pose();
  peer->send(request);  // the socket carries frames as ever
  step();
  EXPECT_EQ(peer->receive().at(0).request_id(), 9u);
}

TEST_F(SessionRing, CarriesRequestsAndPublications) {
  greet();
  const auto publisher = advertise_with_queue(200);
  std::string bytes;
  for (std::uint64_t i = 1; i <= 100; ++i) bytes += frame(publication(publisher, i, 64));
  EXPECT_TRUE(write(bytes)) << "the daemon slept";
  EXPECT_FALSE(write(frame(publication(publisher, 101, 64)))) << "one bell is enough";
  step();
  EXPECT_EQ(counters_.messages_published, 101u);
}

TEST_F(SessionRing, AFullRingIsTakenUpAndItsWriterTold) {
  limits_.ring_bytes = ipc::kRingLeastBytes;
  greet();
  const auto publisher = advertise_with_queue(200);
  std::string bytes;
  for (std::uint64_t i = 1; i <= 12; ++i) bytes += frame(publication(publisher, i, 900));
  std::size_t written = ring->write(bytes);
  EXPECT_EQ(written, ipc::kRingLeastBytes);
  EXPECT_TRUE(ring->wait_for_room());
  ring_bell();
  int told = 0;
  for (int i = 0; i < 10 && written < bytes.size(); ++i) {
    step();
    for (const auto& envelope : peer->receive()) told += envelope.has_room() ? 1 : 0;
    EXPECT_EQ(told, i + 1);
    written += ring->write(std::string_view(bytes).substr(written));
    if (written < bytes.size()) {
      EXPECT_TRUE(ring->wait_for_room());
    }
    ring_bell();
  }
  step();
  ASSERT_EQ(written, bytes.size());
  EXPECT_EQ(counters_.messages_published, 12u);
  EXPECT_TRUE(peer->receive().empty()) << "told once each time";
}

TEST_F(SessionRing, WhatWasWrittenBeforeTheEndIsStillSent) {
  greet();
  const auto publisher = advertise_with_queue(200);
  std::string bytes;
  for (std::uint64_t i = 1; i <= 150; ++i) bytes += frame(publication(publisher, i, 64));
  EXPECT_EQ(ring->write(bytes), bytes.size());
  peer->hang_up();  // without a bell
  step();
  EXPECT_EQ(clients_.size(), 0u);
  EXPECT_EQ(counters_.messages_published, 150u);
}

TEST_F(SessionRing, AnImpossibleCountIsAnsweredCountedAndClosed) {
  greet();
  header->written = 0x80000000u;
  ring_bell();
  step();
  const auto replies = peer->receive();
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_EQ(replies[0].failure().code(), ipc::ERROR_MALFORMED);
  EXPECT_THAT(replies[0].failure().text(), HasSubstr("ring"));
  EXPECT_TRUE(peer->is_closed);
  EXPECT_EQ(counters_.clients_malformed, 1u);
}

TEST_F(SessionRing, FramesBesideTheRingAreAnsweredCountedAndClosed) {
  greet();
  peer->advertise(1, "hello");
  step();
  const auto replies = peer->receive();
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_EQ(replies[0].failure().code(), ipc::ERROR_MALFORMED);
  EXPECT_THAT(replies[0].failure().text(), HasSubstr("bells"));
  EXPECT_TRUE(peer->is_closed);
  EXPECT_EQ(counters_.clients_malformed, 1u);
}

TEST_F(SessionRing, GarbageInTheRingIsAnsweredCountedAndClosed) {
  greet();
  write(std::string(100, '\xFF'));
  step();
  EXPECT_EQ(peer->receive().at(0).failure().code(), ipc::ERROR_MALFORMED);
  EXPECT_TRUE(peer->is_closed);
}

TEST_F(SessionRing, AClientIsServedWithoutOneWhenItsMemoryCannotBePassed) {
  const NoMoreDescriptorsOnTheirWay full;
  const ipc::Hello hello = greet();
  EXPECT_EQ(hello.features_size(), 0);
  EXPECT_EQ(hello.major(), ipc::kProtocolMajor);
  EXPECT_FALSE(ring);
  peer->advertise(1, "hello");
  step();
  EXPECT_EQ(peer->receive().at(0).request_id(), 1u);
}

TEST_F(SessionRing, ComesWithTheFirstHelloOnly) {
  limits_.ring_bytes = 0;
  greet();
  limits_.ring_bytes = ipc::kRingLeastBytes;
  ipc::Envelope again;
  again.mutable_hello()->set_major(ipc::kProtocolMajor);
  again.mutable_hello()->add_features(ipc::kRingFeature);
  peer->send(again);
  step();
  EXPECT_EQ(peer->receive().at(0).hello().features_size(), 0);
}

TEST_F(SessionRing, AClientThatKeepsTheMemoryKeepsNoPagesThatTheDaemonTouched) {
  greet();
  header->written = static_cast<std::uint32_t>(limits_.ring_bytes);  // where nothing was written
  ring_bell();
  step();
  EXPECT_EQ(clients_.size(), 0u);
  struct stat status {};
  ASSERT_EQ(fstat(kept_descriptor, &status), 0);
  EXPECT_LE(static_cast<std::size_t>(status.st_blocks) * 512, ipc::kRingHeaderBytes);
}

TEST_F(SessionRing, AClientMeetsTheEndOfADaemonThatWasAtWorkAtItsNextWrite) {
  greet();
  ring_bell();
  EXPECT_EQ(header->reader_sleeps, 0u);
  clients_.close_all("test");
  ring->write("x");
  EXPECT_TRUE(ring->take_sleeping_reader()) << "the bell is what fails";
}

TEST_F(SessionRing, AThousandBellsWithoutBytesDoNothing) {
  greet();
  peer->send_bytes(std::string(1000, static_cast<char>(ipc::kBell)));
  step();
  EXPECT_TRUE(peer->receive().empty());
  const auto publisher = advertise_with_queue(0);
  write(frame(publication(publisher, 1, 3)));
  step();
  EXPECT_EQ(counters_.messages_published, 1u);
}

TEST_F(SessionRing, BellsAreLeftUnreadAndHoldNoWriterUp) {
  greet();
  const auto publisher = advertise_with_queue(10);
  step();
  int unread = 0;
  int most_unread = 0;
  for (std::uint64_t i = 1; i <= 1000; ++i) {
    ASSERT_TRUE(write(frame(publication(publisher, i, 1)))) << "it sleeps after each";
    step();
    ASSERT_EQ(counters_.messages_published, i);
    peer->receive();
    station_.leave(1);
    step();
    ASSERT_EQ(ioctl(socket, SIOCOUTQ, &unread), 0);
    most_unread = std::max(most_unread, unread);
  }
  EXPECT_GT(most_unread, 0) << "each was read: a system call more for each message";
  EXPECT_LT(most_unread, 150 * 1024) << "bytes of the kernel's memory";
}

// A bell may carry its connection's own other end, which then lives as long as it is not read.
TEST_F(SessionRing, AConnectionEndsWhoseOtherEndIsInABell) {
  greet();
  const auto publisher = advertise_with_queue(10);
  ASSERT_EQ(ring->write(frame(publication(publisher, 1, 1))),
            frame(publication(publisher, 1, 1)).size());
  ASSERT_TRUE(ring->take_sleeping_reader());
  const char bell = static_cast<char>(ipc::kBell);
  ASSERT_EQ(ipc::send_with_descriptor(socket, &bell, 1, socket), 1);
  peer->hang_up();
  step();
  EXPECT_EQ(counters_.messages_published, 1u);
  const auto deadline = std::chrono::steady_clock::now() + test::kPatience;
  while (clients_.size() > 0 && std::chrono::steady_clock::now() < deadline) {
    io_.restart();
    io_.run_for(std::chrono::milliseconds(50));
  }
  EXPECT_EQ(clients_.size(), 0u);
}

}  // namespace
}  // namespace swarmtalk::daemon
