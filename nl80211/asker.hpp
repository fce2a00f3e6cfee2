// Asker: one question to the kernel's 802.11 (nl80211, generic netlink) and its answer as the bytes
// that the kernel sent. KernelAsker asks by libnl; tests answer from recordings instead. Needs no
// privilege to ask; to change something, CAP_NET_ADMIN. Blocks for at most kAnswerTimeoutMs.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

struct nl_sock;

namespace swarmtalk::nl80211 {

struct Question {
  std::uint8_t command = 0;  // NL80211_CMD_...
  bool is_dump = false;      // about all there are: several messages
  unsigned interface = 0;    // index
  // To change something; 0: no such attribute.
  struct Value {
    std::uint16_t attribute;          // NL80211_ATTR_...
    std::vector<std::uint8_t> bytes;  // in the order of this machine
  };
  std::vector<Value> values = {};
};

struct Answer {
  int error = 0;  // errno; ENODEV: no such interface, or it is not of this kind
  // Whole netlink messages, header included, without the kernel's "done".
  std::vector<std::vector<std::uint8_t>> messages = {};
};

class Asker {
 public:
  virtual ~Asker() = default;
  virtual Answer ask(const Question& question) = 0;
};

class KernelAsker final : public Asker {
 public:
  static constexpr int kAnswerTimeoutMs = 500;

  KernelAsker();
  ~KernelAsker() override;
  KernelAsker(const KernelAsker&) = delete;
  KernelAsker& operator=(const KernelAsker&) = delete;

  /// Whether this kernel has 802.11 at all; opens the socket in the caller's network namespace.
  bool is_there() const { return family_ >= 0; }
  Answer ask(const Question& question) override;

 private:
  struct Closer {
    void operator()(nl_sock* socket) const;
  };
  std::unique_ptr<nl_sock, Closer> socket_;
  int family_ = -1;
};

}  // namespace swarmtalk::nl80211
