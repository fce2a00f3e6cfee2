// Harvest: values of this program for whoever asks, and questions for those of others, over several
// hops. It speaks on the reserved channel "harvest", which the daemon's configuration must switch
// on (docs/configuration.md, [reserved]). On its Client's thread.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>

#include <swarmtalk/client.hpp>

namespace swarmtalk {

/// One value of one program of a robot.
struct HarvestedValue {
  std::uint32_t node_id = 0;  // whose it is
  std::uint32_t epoch = 0;    // tells two starts of its daemon apart
  std::uint32_t hops = 0;     // that the answer travelled, as Message::hops
  bool local = false;         // of a program on this robot
  std::string key;
  std::string value;
};

/// Answers questions for values of this program, and asks for those of others.
class Harvest {
 public:
  static constexpr std::size_t kMaxKeyBytes = 64;
  static constexpr std::size_t kMaxValueBytes = 512;
  static constexpr std::size_t kMaxValues = 64;
  static constexpr std::uint32_t kDefaultTtl = 4;  // hops after the first, there and back

  /// Called with each value that comes.
  using Callback = std::function<void(const HarvestedValue&)>;

  /// Registers with the daemon; see status(). @param client  must outlive this object
  explicit Harvest(Client& client);
  Harvest(const Harvest&) = delete;
  Harvest& operator=(const Harvest&) = delete;

  /// Ok; or why the daemon refused, kBadChannel where harvest is off; kDisconnected.
  Status status() const;

  /// From now on this value answers questions for `key`. @param key  1 to kMaxKeyBytes bytes
  /// @param value  at most kMaxValueBytes bytes. @return kBadArgument: too long, or kMaxValues are
  /// set
  Status set(std::string_view key, std::string_view value);
  /// The value answers no more.
  void remove(std::string_view key);

  /// Asks all robots within `ttl` hops after the first for their values whose keys begin with
  /// `prefix`. Answers come to `found` until the next ask(). Robots may answer late or never, and
  /// each answer is a message of its own that may be lost: ask again.
  /// @return as Publisher::send()
  Status ask(std::string_view prefix, Callback found, std::uint32_t ttl = kDefaultTtl);

 private:
  void hear(const Message& message);
  void answer(std::uint32_t question, std::uint32_t ttl, std::string_view prefix);

  std::map<std::string, std::string, std::less<>> values_;
  Callback found_;
  std::uint32_t question_ = 0;  // 0: none was asked
  Publisher publisher_;
  Subscriber subscriber_;
};

}  // namespace swarmtalk
