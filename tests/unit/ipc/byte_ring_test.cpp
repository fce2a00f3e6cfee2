#include "ipc/byte_ring.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <random>
#include <string>
#include <thread>

#include "ipc/pass_descriptor.hpp"
#include "tests/support/patience.hpp"

namespace swarmtalk::ipc {
namespace {

constexpr std::size_t kCapacity = kRingLeastBytes;

/// Both ends in one process, on two mappings of one memory.
class RingTest : public testing::Test {
 protected:
  RingTest() {
    RingMemory memory = RingMemory::create(kCapacity);
    RingMemory other = RingMemory::adopt(::dup(memory.descriptor()));
    EXPECT_TRUE(memory.is_valid() && other.is_valid());
    EXPECT_NE(memory.data(), other.data());
    writes_into = &other.header();
    reader.emplace(std::move(memory));
    writer.emplace(std::move(other));
  }
  std::optional<std::string> read(std::size_t at_most = 2 * kCapacity) {
    std::string bytes(at_most, '\0');
    const auto got = reader->read({reinterpret_cast<std::uint8_t*>(bytes.data()), bytes.size()});
    if (!got) return std::nullopt;
    bytes.resize(*got);
    return bytes;
  }

  RingHeader* writes_into = nullptr;
  std::optional<RingReader> reader;
  std::optional<RingWriter> writer;
};

TEST_F(RingTest, BytesComeInOrderAlsoAcrossTheEnd) {
  std::mt19937 random(1);
  std::string sent;
  std::string got;
  while (sent.size() < 20 * kCapacity) {
    std::string piece(random() % kCapacity, '\0');
    for (char& byte : piece) byte = static_cast<char>(random());
    const std::size_t taken = writer->write(piece);
    sent += piece.substr(0, taken);
    got += read(random() % kCapacity).value();
  }
  got += read().value();
  EXPECT_EQ(got, sent);
  EXPECT_EQ(read(), "");
}

TEST_F(RingTest, TakesWhatFitsAndNoMore) {
  EXPECT_EQ(writer->write(std::string(kCapacity - 1, 'a')), kCapacity - 1);
  EXPECT_EQ(writer->write("bcd"), 1u);
  EXPECT_EQ(writer->write("cd"), 0u);
  EXPECT_EQ(read(10), "aaaaaaaaaa");
  EXPECT_EQ(writer->write("cd"), 2u);
}

TEST_F(RingTest, CountsWrapAround) {
  const std::string piece(kCapacity, 'x');
  for (std::uint64_t bytes = 0; bytes < (std::uint64_t{1} << 32) + 3 * kCapacity;
       bytes += kCapacity) {
    ASSERT_EQ(writer->write(piece), kCapacity);
    ASSERT_EQ(writer->write("y"), 0u);
    std::array<std::uint8_t, kCapacity> room;
    ASSERT_EQ(reader->read(room), kCapacity);
    ASSERT_EQ(reader->read(room), 0u);
  }
}

TEST_F(RingTest, ASleepingReaderIsWokenOnceAndNeverSleepsOnBytes) {
  EXPECT_TRUE(writer->take_sleeping_reader()) << "it sleeps at first";
  EXPECT_FALSE(writer->take_sleeping_reader());
  EXPECT_TRUE(reader->sleep());
  writer->write("a");
  EXPECT_TRUE(writer->take_sleeping_reader());
  EXPECT_FALSE(reader->sleep());
  EXPECT_FALSE(writer->take_sleeping_reader()) << "it stays awake";
  EXPECT_EQ(read(), "a");
  EXPECT_TRUE(reader->sleep());
}

TEST_F(RingTest, AWaitingWriterIsToldOnceAndNeverWaitsForRoomThatIsThere) {
  writer->write(std::string(kCapacity, 'a'));
  EXPECT_FALSE(reader->take_waiting_writer());
  EXPECT_TRUE(writer->wait_for_room());
  EXPECT_EQ(read(1), "a");
  EXPECT_TRUE(reader->take_waiting_writer());
  EXPECT_FALSE(reader->take_waiting_writer());
  EXPECT_FALSE(writer->wait_for_room());
  EXPECT_FALSE(reader->take_waiting_writer());
}

TEST_F(RingTest, AnImpossibleCountOfTheWriterIsNoticed) {
  writer->write("abc");
  writes_into->written = kCapacity + 1;
  EXPECT_EQ(read(), std::nullopt);
  writes_into->written = static_cast<std::uint32_t>(-1);
  EXPECT_EQ(read(), std::nullopt);
}

TEST_F(RingTest, ReadingWhereThePagesWereTakenAwayMakesNoNewOnes) {
  const auto blocks = [this] {
    struct stat status {};
    EXPECT_EQ(::fstat(reader->memory().descriptor(), &status), 0);
    return status.st_blocks;
  };
  writer->write(std::string(kCapacity, 'a'));
  const int descriptor = reader->memory().descriptor();
  ASSERT_EQ(::fallocate(descriptor, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, kRingHeaderBytes,
                        kCapacity),
            0);
  const auto before = blocks();
  EXPECT_EQ(read(), std::string(kCapacity, '\0'));
  EXPECT_EQ(blocks(), before);
}

TEST_F(RingTest, AHeaderWhosePageWasTakenAwayIsNoticed) {
  writer->write("abc");
  EXPECT_FALSE(reader->is_spoiled());
  const int descriptor = reader->memory().descriptor();
  ASSERT_EQ(
      ::fallocate(descriptor, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, 0, kRingHeaderBytes), 0);
  EXPECT_EQ(read(), std::nullopt);
  EXPECT_TRUE(reader->is_spoiled());
}

TEST_F(RingTest, AWriterThatLeavesSaysSo) {
  EXPECT_FALSE(reader->writer_has_left());
  writer->leave();
  EXPECT_TRUE(reader->writer_has_left());
}

TEST_F(RingTest, TheReadersCountCannotBeSetByTheWriter) {
  writer->write("abcdef");
  EXPECT_EQ(read(3), "abc");
  writes_into->read = 0;
  EXPECT_EQ(read(), "def");
}

TEST_F(RingTest, AnImpossibleCountOfTheReaderIsNoRoom) {
  writes_into->read = 7;  // more than was ever written
  EXPECT_EQ(writer->write("abc"), 0u);
}

TEST(RingMemory, HasOnlyLegalSizes) {
  EXPECT_FALSE(RingMemory::create(0).is_valid());
  EXPECT_FALSE(RingMemory::create(kRingLeastBytes / 2).is_valid());
  EXPECT_FALSE(RingMemory::create(kRingLeastBytes + 1).is_valid());
  EXPECT_FALSE(RingMemory::create(kRingMostBytes * 2).is_valid());
  EXPECT_TRUE(RingMemory::create(kRingMostBytes).is_valid());
}

TEST(RingMemory, CannotBeResizedByTheOtherProcess) {
  const RingMemory memory = RingMemory::create(kCapacity);
  EXPECT_NE(::ftruncate(memory.descriptor(), 0), 0);
  EXPECT_NE(::ftruncate(memory.descriptor(), 1 << 20), 0);
}

TEST(RingMemory, AdoptsNothingElse) {
  EXPECT_FALSE(RingMemory::adopt(-1).is_valid());
  EXPECT_FALSE(RingMemory::adopt(::open("/dev/null", O_RDWR)).is_valid());
  // Of the right size, but it could shrink under us.
  const int unsealed = memfd_create("unsealed", MFD_ALLOW_SEALING);
  ASSERT_EQ(::ftruncate(unsealed, kRingHeaderBytes + kCapacity), 0);
  EXPECT_FALSE(RingMemory::adopt(unsealed).is_valid());
  const int odd = memfd_create("odd", MFD_ALLOW_SEALING);
  ASSERT_EQ(::ftruncate(odd, kRingHeaderBytes + kCapacity + 1), 0);
  ASSERT_EQ(::fcntl(odd, F_ADD_SEALS, F_SEAL_SHRINK), 0);
  EXPECT_FALSE(RingMemory::adopt(odd).is_valid());
}

TEST(PassDescriptor, GoesWithTheBytes) {
  int ends[2];
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
  RingMemory memory = RingMemory::create(kCapacity);
  ASSERT_EQ(send_with_descriptor(ends[0], "hello", 5, memory.descriptor()), 5);
  std::array<char, 16> bytes;
  int descriptor = -1;
  ASSERT_EQ(receive_with_descriptor(ends[1], bytes.data(), bytes.size(), descriptor), 5);
  const RingMemory other = RingMemory::adopt(descriptor);
  ASSERT_TRUE(other.is_valid());
  memory.data()[0] = 42;
  EXPECT_EQ(other.data()[0], 42);
  ASSERT_EQ(::send(ends[0], "x", 1, 0), 1);
  descriptor = -1;
  ASSERT_EQ(receive_with_descriptor(ends[1], bytes.data(), bytes.size(), descriptor), 1);
  EXPECT_EQ(descriptor, -1);
  ::close(ends[0]);
  ::close(ends[1]);
}

// Two threads, the bell a pipe: were a wake-up ever lost, one of them would wait for good.
TEST_F(RingTest, NoWakeUpIsLost) {
  constexpr std::size_t kTotal = 8 << 20;
  constexpr int kPatienceMs = std::chrono::milliseconds(test::kPatience).count();
  int bell[2];
  int room[2];
  ASSERT_EQ(::pipe2(bell, O_CLOEXEC), 0);
  ASSERT_EQ(::pipe2(room, O_CLOEXEC), 0);
  const auto wait = [](int descriptor) {
    pollfd waiting{descriptor, POLLIN, 0};
    if (::poll(&waiting, 1, kPatienceMs) != 1) return false;
    char byte = 0;
    return ::read(descriptor, &byte, 1) == 1;
  };
  bool writer_ok = true;
  std::thread other([&] {
    std::mt19937 random(2);
    std::uint8_t next = 0;
    for (std::size_t sent = 0; sent < kTotal && writer_ok;) {
      std::string piece(std::min<std::size_t>(1 + random() % 300, kTotal - sent), '\0');
      for (char& byte : piece) byte = static_cast<char>(next++);
      for (std::size_t done = 0; done < piece.size() && writer_ok;) {
        const std::size_t count = writer->write(std::string_view(piece).substr(done));
        done += count;
        if (writer->take_sleeping_reader()) writer_ok = ::write(bell[1], "b", 1) == 1;
        if (count == 0 && writer->wait_for_room()) writer_ok = wait(room[0]);
      }
      sent += piece.size();
    }
  });
  std::uint8_t expected = 0;
  std::size_t got = 0;
  bool is_right = true;
  while (got < kTotal && is_right) {
    std::array<std::uint8_t, 1000> bytes;
    const std::size_t count = reader->read(bytes).value_or(0);
    if (count > 0 && reader->take_waiting_writer()) is_right = ::write(room[1], "r", 1) == 1;
    for (std::size_t i = 0; i < count; ++i) is_right = is_right && bytes[i] == expected++;
    got += count;
    if (count == 0 && reader->sleep()) is_right = wait(bell[0]);
  }
  EXPECT_TRUE(is_right) << "after " << got << " bytes";
  if (!is_right) writer_ok = false;
  ::close(bell[0]);
  other.join();
  EXPECT_TRUE(writer_ok || !is_right);
  for (const int descriptor : {bell[1], room[0], room[1]}) ::close(descriptor);
}

}  // namespace
}  // namespace swarmtalk::ipc
