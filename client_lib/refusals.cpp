#include "client_lib/refusals.hpp"

#include <chrono>
#include <cstdio>
#include <string>
#include <utility>

namespace swarmtalk::client {

std::optional<Status> Refusals::note(std::string_view channel, std::string_view why, bool is_unread,
                                     Wakeup::Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  ++count_;
  if (told_ && now - *told_ < std::chrono::seconds(1)) return std::nullopt;
  told_ = now;
  const std::uint64_t count = std::exchange(count_, 0);
  const std::string text =
      std::string(channel) + ": " +
      (count == 1 ? "a message was" : std::to_string(count) + " messages were") + " not sent" +
      (is_unread ? ", and nobody looked at what send() returned" : "") + ": " + std::string(why);
  if (!tells_stderr()) return Status(StatusCode::kBusy, text);
  std::fprintf(stderr, "swarmtalk: %s\n", text.c_str());
  return std::nullopt;
}

void Refusals::tell_rest() {
  const std::lock_guard lock(mutex_);
  const std::uint64_t count = std::exchange(count_, 0);
  if (count == 0 || !tells_stderr()) return;
  std::fprintf(stderr, "swarmtalk: since then %llu more of this program's messages %s not sent\n",
               static_cast<unsigned long long>(count), count == 1 ? "was" : "were");
}

}  // namespace swarmtalk::client
