#include "ipc/byte_ring.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <new>
#include <utility>

namespace swarmtalk::ipc {
namespace {

#ifndef MFD_NOEXEC_SEAL
constexpr unsigned MFD_NOEXEC_SEAL = 0x0008;  // Linux 6.3; headers of Debian 12 lack it
#endif

bool is_capacity(std::size_t bytes) {
  return std::has_single_bit(bytes) && bytes >= kRingLeastBytes && bytes <= kRingMostBytes;
}

int make_memory(std::size_t bytes) {
  constexpr unsigned kFlags = MFD_CLOEXEC | MFD_ALLOW_SEALING;
  int descriptor = memfd_create("swarmtalk-ring", kFlags | MFD_NOEXEC_SEAL);
  if (descriptor < 0) descriptor = memfd_create("swarmtalk-ring", kFlags);
  if (descriptor < 0) return -1;
  // A mapping beyond the end of a file that shrank would kill whoever touches it.
  constexpr int kSeals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL;
  if (ftruncate(descriptor, static_cast<off_t>(bytes)) == 0 &&
      fcntl(descriptor, F_ADD_SEALS, kSeals) == 0) {
    return descriptor;
  }
  close(descriptor);
  return -1;
}

}  // namespace

RingMemory::RingMemory(RingMemory&& other) noexcept {
  *this = std::move(other);
}

RingMemory& RingMemory::operator=(RingMemory&& other) noexcept {
  if (this == &other) return *this;
  reset();
  bytes_ = std::exchange(other.bytes_, nullptr);
  capacity_ = std::exchange(other.capacity_, 0);
  descriptor_ = std::exchange(other.descriptor_, -1);
  return *this;
}

void RingMemory::close_descriptor() {
  if (descriptor_ >= 0) close(descriptor_);
  descriptor_ = -1;
}

void RingMemory::reset() {
  close_descriptor();
  unmap();
  capacity_ = 0;
}

void RingMemory::unmap() {
  if (bytes_ != nullptr) munmap(bytes_, kRingHeaderBytes + capacity_);
  bytes_ = nullptr;
}

void RingMemory::begin() {
  new (bytes_) RingHeader{};
  header().reader_sleeps = 1;
  header().mark = kRingMark;
}

bool RingMemory::begin_again() {
  if (descriptor_ < 0 || !map(descriptor_, capacity_)) return false;
  begin();
  return true;
}

bool RingMemory::map(int descriptor, std::size_t capacity_bytes) {
  void* memory = mmap(nullptr, kRingHeaderBytes + capacity_bytes, PROT_READ | PROT_WRITE,
                      MAP_SHARED, descriptor, 0);
  if (memory == MAP_FAILED) return false;
  bytes_ = static_cast<std::uint8_t*>(memory);
  capacity_ = static_cast<std::uint32_t>(capacity_bytes);
  return true;
}

RingMemory RingMemory::create(std::size_t capacity_bytes) {
  RingMemory memory;
  if (!is_capacity(capacity_bytes)) return memory;
  memory.descriptor_ = make_memory(kRingHeaderBytes + capacity_bytes);
  if (memory.descriptor_ < 0 || !memory.map(memory.descriptor_, capacity_bytes)) {
    memory.reset();
    return memory;
  }
  memory.begin();
  return memory;
}

RingMemory RingMemory::adopt(int descriptor) {
  RingMemory memory;
  memory.descriptor_ = descriptor;
  struct stat status {};
  const bool is_sealed = (std::max(fcntl(descriptor, F_GET_SEALS), 0) & F_SEAL_SHRINK) != 0 &&
                         fstat(descriptor, &status) == 0;
  const auto bytes = static_cast<std::size_t>(std::max<off_t>(status.st_size, 0));
  const bool is_ring =
      is_sealed && bytes > kRingHeaderBytes && is_capacity(bytes - kRingHeaderBytes);
  if (is_ring) memory.map(descriptor, bytes - kRingHeaderBytes);
  memory.close_descriptor();
  return memory;
}

// Read as a file: where the writer has given a page back to the system, a look through the mapping
// would make a new one, and a page counts as memory of who touches it first. The writer could hold
// on to as many as it likes, at our cost.
bool RingReader::copy(std::size_t begin, std::span<std::uint8_t> room) const {
  const auto at = static_cast<off_t>(kRingHeaderBytes + begin);
  return room.empty() || pread(memory_.descriptor(), room.data(), room.size(), at) ==
                             static_cast<ssize_t>(room.size());
}

std::optional<std::size_t> RingReader::read(std::span<std::uint8_t> room) {
  if (is_spoiled()) return std::nullopt;
  const std::uint32_t held = memory_.header().written.load() - read_;
  if (held > memory_.capacity()) return std::nullopt;
  const std::size_t count = std::min<std::size_t>(held, room.size());
  const std::size_t begin = read_ & (memory_.capacity() - 1);
  const std::size_t first = std::min(count, memory_.capacity() - begin);
  if (!copy(begin, room.first(first))) return std::nullopt;
  if (!copy(0, room.subspan(first, count - first))) return std::nullopt;
  read_ += static_cast<std::uint32_t>(count);
  memory_.header().read.store(read_);
  return count;
}

// Each side stores its own flag or count, then looks at the other's, here and below, all in the one
// order of all threads (seq_cst): of the two at least one sees what the other did.
bool RingReader::sleep() {
  RingHeader& header = memory_.header();
  header.reader_sleeps.store(1);
  if (header.written.load() == read_) return true;
  header.reader_sleeps.store(0);
  return false;
}

bool RingReader::take_waiting_writer() {
  RingHeader& header = memory_.header();
  return header.writer_waits.load() != 0 && header.writer_waits.exchange(0) != 0;
}

void RingReader::leave() {
  memory_.header().reader_sleeps.store(1);
  madvise(memory_.data(), memory_.capacity(), MADV_REMOVE);
}

std::uint32_t RingWriter::room() const {
  const std::uint32_t held = written_ - memory_.header().read.load();
  return held > memory_.capacity() ? 0 : memory_.capacity() - held;
}

std::size_t RingWriter::write(std::string_view bytes) {
  const std::size_t count = std::min<std::size_t>(bytes.size(), room());
  const std::size_t begin = written_ & (memory_.capacity() - 1);
  const std::size_t first = std::min(count, memory_.capacity() - begin);
  std::memcpy(memory_.data() + begin, bytes.data(), first);
  std::memcpy(memory_.data(), bytes.data() + first, count - first);
  written_ += static_cast<std::uint32_t>(count);
  memory_.header().written.store(written_);
  return count;
}

bool RingWriter::take_sleeping_reader() {
  RingHeader& header = memory_.header();
  return header.reader_sleeps.load() != 0 && header.reader_sleeps.exchange(0) != 0;
}

bool RingWriter::wait_for_room() {
  RingHeader& header = memory_.header();
  header.writer_waits.store(1);
  if (room() == 0) return true;
  header.writer_waits.store(0);
  return false;
}

}  // namespace swarmtalk::ipc
