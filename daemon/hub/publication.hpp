// Publication: one accepted message on its way out, of a program or a gateway rule. It lives until
// every station that took it is done with it; its memory is used again.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/config/config.hpp"
#include "daemon/hub/hub_client.hpp"
#include "daemon/message/gateway_origin.hpp"

namespace swarmtalk::daemon {

/// What is known of it, without its bytes.
struct PublicationHead {
  Publisher* owner = nullptr;  // none: a gateway rule's; one without a client: that is gone
  std::uint64_t client = 0;    // serial of who must not hear it, gone or not; 0: nobody
  UserShare* user = nullptr;   // whose share it is in; none: a gateway rule's
  std::uint64_t number = 0;    // the client's
  std::uint8_t ttl = 0;
  std::uint8_t redundancy = 0;
  std::uint64_t sent_at_ns = 0;  // monotonic: when the app called send()
  std::uint32_t copies = 1;
  std::uint32_t copy_interval_ms = 0;
  std::uint32_t pending = 0;     // stations that have not sent it
  std::uint32_t sent = 0;        // stations that have
  std::uint32_t parked = 0;      // stations where it waits for its next copy's time
  std::uint32_t air_number = 0;  // on all links; 0: each counts by itself
  bool is_heard_locally = false;
  // Of a copy that a gateway rule makes: it has no owner.
  const GatewayRule* rule = nullptr;
  std::optional<GatewayOrigin> origin;
  bool is_replaced = false;  // by a newer copy
  std::uint64_t serial = 0;  // of all publications: the memory is used again, this is not

  /// Since its program sent it. The client says when; a time to come counts as now.
  /// @param now_ns  monotonic
  std::uint64_t waited_us(std::uint64_t now_ns) const;
  /// The same as a delivery tells it: at most UINT32_MAX, 71 minutes.
  std::uint32_t told_us(std::uint64_t now_ns) const;
};

struct Publication : PublicationHead {
  std::string payload;

  std::span<const std::uint8_t> bytes() const {
    return {reinterpret_cast<const std::uint8_t*>(payload.data()), payload.size()};
  }
};

class PublicationPool {
 public:
  /// Everything at its default, with a serial of its own; the payload is what its last user left.
  Publication& take();
  void give_back(Publication& publication) { free_.push_back(&publication); }

 private:
  std::vector<std::unique_ptr<Publication>> all_;
  std::vector<Publication*> free_;
  std::uint64_t last_serial_ = 0;
};

}  // namespace swarmtalk::daemon
