#include "cli/common/link_watch.hpp"

#include <string>

#include "cli/common/commands.hpp"

namespace swarmtalk::cli {
namespace {

constexpr std::chrono::seconds kPeriod{2};

}  // namespace

void LinkWatch::look() {
  if (Clock::now() < next_) return;
  DaemonStatus daemon;
  if (client_.get_status(daemon)) tell(daemon);
  next_ = Clock::now() + kPeriod;
}

void LinkWatch::tell(const DaemonStatus& daemon) {
  std::string dead;
  std::string alive;
  for (const auto& link : daemon.links) {
    std::string& list = link.up ? alive : dead;
    list += (list.empty() ? "" : ", ") + (link.up ? link.name : link.name + ": " + link.state);
  }
  const bool is_dead = alive.empty() && !dead.empty();
  if (is_dead && !is_told_dead_) {
    fail("no link is up (" + dead + "), so nothing comes from other robots; bring one up, this " +
         "goes on by itself");
  }
  if (!is_dead && is_told_dead_) fail("a link is up again: " + alive);
  is_told_dead_ = is_dead;
  has_told_ = has_told_ || is_dead;
}

}  // namespace swarmtalk::cli
