// A ring of bytes in memory that two processes share: the way from a client to the daemon, beside
// their socket. A writer whose reader is at work makes no system call; the socket then only wakes
// the reader (a bell), passes the memory, and ends. Neither side trusts what the other writes here.
// Used by daemon (reads) and client_lib (writes); docs/ipc.md describes it for others.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace swarmtalk::ipc {

inline constexpr const char* kRingFeature = "ring";     // in Hello.features
inline constexpr std::uint8_t kBell = 0xB7;             // what the socket then carries
inline constexpr std::uint32_t kRingMark = 0x676e6972;  // a page that was given back has zeros here
inline constexpr std::size_t kRingHeaderBytes = 4096;
inline constexpr std::size_t kRingLeastBytes = 4096;
inline constexpr std::size_t kRingMostBytes = std::size_t{1} << 20;

/// The start of the shared memory. Counts are of bytes since the beginning, modulo 2^32.
struct RingHeader {
  alignas(64) std::atomic<std::uint32_t> written;        // by the writer
  alignas(64) std::atomic<std::uint32_t> read;           // by the reader
  alignas(64) std::atomic<std::uint32_t> reader_sleeps;  // 1: ring the bell after writing
  alignas(64) std::atomic<std::uint32_t> writer_waits;   // 1: tell it when there is room
  alignas(64) std::atomic<std::uint32_t> writer_left;    // 1: it will not touch this memory again
  alignas(64) std::atomic<std::uint32_t> mark;           // kRingMark, by the reader
};
static_assert(sizeof(RingHeader) <= kRingHeaderBytes);
static_assert(std::atomic<std::uint32_t>::is_always_lock_free, "two processes share them");

/// A mapping of that memory, and its descriptor; closed with it. Moves, does not copy.
class RingMemory {
 public:
  RingMemory() = default;
  RingMemory(RingMemory&& other) noexcept;
  RingMemory& operator=(RingMemory&& other) noexcept;
  ~RingMemory() { reset(); }

  /// New memory, which can neither shrink nor grow. Invalid when the system has none.
  /// @param capacity_bytes  a power of two from kRingLeastBytes to kRingMostBytes
  static RingMemory create(std::size_t capacity_bytes);

  /// What another process made and passed. Invalid when it is not such memory.
  /// @param descriptor  owned from now on
  static RingMemory adopt(int descriptor);

  bool is_valid() const { return bytes_ != nullptr; }
  /// To pass to the other process; -1: closed.
  int descriptor() const { return descriptor_; }
  /// The mapping does not need it.
  void close_descriptor();
  void reset();

  /// Gives up the mapping and keeps the descriptor, with what is in the memory.
  void unmap();
  /// Maps it again, for another writer. @return false: the system has no memory
  bool begin_again();

  RingHeader& header() const { return *reinterpret_cast<RingHeader*>(bytes_); }
  std::uint8_t* data() const { return bytes_ + kRingHeaderBytes; }
  std::uint32_t capacity() const { return capacity_; }

 private:
  void begin();
  bool map(int descriptor, std::size_t capacity_bytes);

  std::uint8_t* bytes_ = nullptr;
  std::uint32_t capacity_ = 0;
  int descriptor_ = -1;
};

/// One thread of one process. All functions need a valid memory.
class RingReader {
 public:
  explicit RingReader(RingMemory memory) : memory_(std::move(memory)) {}
  RingMemory& memory() { return memory_; }

  /// Takes what is there, at most `room`. @return bytes taken; none: the writer's count is
  ///   impossible, or it has taken the memory away, and nothing after this can be believed
  /// @pre the memory's descriptor is open
  std::optional<std::size_t> read(std::span<std::uint8_t> room);

  /// Whether there seems to be something to read.
  bool has_bytes() const { return memory_.header().written.load() != read_; }

  /// From now on the writer rings the bell. @return false: there is something to read, stay awake
  bool sleep();

  /// Whether the writer waits for room and has to be told that there is some; once each time.
  bool take_waiting_writer();

  /// The last call: nothing more is read. The writer's next write rings the bell, so that it meets
  /// the end; the pages of the bytes go back to the system, though the writer may keep the memory.
  void leave();

  /// Whether the writer has said that it will not touch the memory again.
  bool writer_has_left() const { return memory_.header().writer_left.load() != 0; }
  /// Whether pages were given back to the system that are in use: our next look would make new
  /// ones, at our cost.
  bool is_spoiled() const { return memory_.header().mark.load() != kRingMark; }

 private:
  bool copy(std::size_t begin, std::span<std::uint8_t> room) const;

  RingMemory memory_;
  std::uint32_t read_ = 0;  // the header's copy is for the writer
};

/// One thread at a time of one process. All functions need a valid memory.
class RingWriter {
 public:
  explicit RingWriter(RingMemory memory) : memory_(std::move(memory)) {}

  /// @return how many of the first bytes were taken
  std::size_t write(std::string_view bytes);

  /// Whether the reader sleeps and must be woken by a bell; once each time.
  bool take_sleeping_reader();

  /// Asks to be told of room. @return false: there is some by now, write on
  bool wait_for_room();

  /// The last call: the memory may be another's from now on.
  void leave() { memory_.header().writer_left.store(1); }

 private:
  std::uint32_t room() const;

  RingMemory memory_;
  std::uint32_t written_ = 0;  // the header's copy is for the reader
};

}  // namespace swarmtalk::ipc
