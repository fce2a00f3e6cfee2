// Sender: a program's messages on their way out, of any thread: what can be refused here, and what
// is written at once. All that it shares with the owner's thread is behind the gate.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string_view>
#include <utility>

#include "client_lib/connection.hpp"
#include "client_lib/reports.hpp"
#include "client_lib/state.hpp"

namespace swarmtalk::client {

/// How many of its messages were refused here since the daemon was told last. @pre gate held
void fill_refusals(PublisherState& publisher, ipc::ClientLoss& loss);

class Sender {
 public:
  struct Hooks {
    std::function<void()> wake;  // the owner, who can do what other threads cannot
    /// Reads answers that wait, in the owner's thread; a program that only sends never runs.
    std::function<void()> look_for_answers;
  };
  /// All must outlive it.
  Sender(std::mutex& gate, Connection& connection, Reports& reports, Hooks hooks)
      : gate_(gate), connection_(connection), reports_(reports), hooks_(std::move(hooks)) {}

  /// @param is_inside  in a callback: its owner looks around at its end
  Status publish(PublisherState& publisher, std::string_view payload,
                 std::optional<std::uint32_t> ttl, bool is_inside);
  bool is_busy(const PublisherState& publisher);
  /// Whether anything was handed to the daemon, or was to be.
  bool has_sent() const { return has_sent_.load(); }

  /// Whether messages were refused here that the daemon may not know of: their untold_refusals.
  bool take_has_refused() { return has_refused_.exchange(false); }

 private:
  Status check_publication(const PublisherState& publisher, std::size_t size_bytes,
                           std::optional<std::uint32_t> ttl) const;
  Status check_room(const PublisherState& publisher) const;
  bool needs_answers(const PublisherState& publisher) const;
  Status append_publication(PublisherState& publisher, std::string_view payload,
                            std::optional<std::uint32_t> ttl);
  bool note_refusal(PublisherState& publisher);

  std::mutex& gate_;
  Connection& connection_;
  Reports& reports_;
  Hooks hooks_;
  std::atomic<bool> has_sent_{false};
  std::atomic<bool> has_refused_{false};
};

}  // namespace swarmtalk::client
