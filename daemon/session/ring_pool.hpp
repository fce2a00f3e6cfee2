// RingPool: the memory of the clients' rings. Whoever was passed a ring's memory may keep it, so
// that what is made for each connection could grow without end at the daemon's cost: memory is made
// a bounded number of times for each user and used again for the same user's next client, once the
// one before says that it has left, or its process has ended. On the daemon's thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "daemon/config/config.hpp"
#include "daemon/session/client_identity.hpp"
#include "ipc/byte_ring.hpp"

namespace swarmtalk::daemon {

class RingPool {
 public:
  /// Outlived by `limits`.
  explicit RingPool(const LimitsConfig& limits) : limits_(limits) {}

  /// Memory for a new client, as limits.ring_bytes says. @return none: the system has none, or this
  ///   user's is all in use; the client is served through its socket
  std::optional<ipc::RingMemory> take(const ClientIdentity& client);

  /// A client's ring has ended. @param has_left  it said that it will not touch the memory again
  void give_back(ipc::RingMemory memory, const ClientIdentity& client, bool has_left);

  /// The client took pages out of memory in use: its user gets no ring any more.
  void bar(const ClientIdentity& client) { barred_.insert(client.uid); }

  /// Made so far, all of them in use or kept.
  std::size_t size() const { return size_; }

 private:
  struct Kept {
    ipc::RingMemory memory;
    ClientIdentity client;
    bool is_free;  // its client said so
  };

  std::optional<ipc::RingMemory> take_kept(const ClientIdentity& client);
  bool may_make(const ClientIdentity& client) const;

  const LimitsConfig& limits_;
  std::vector<Kept> kept_;
  std::map<std::uint32_t, std::uint32_t> made_;  // for each uid
  std::set<std::uint32_t> barred_;               // uids
  std::size_t size_ = 0;
};

}  // namespace swarmtalk::daemon
