#include "drivers/link/unreadable_frames.hpp"

namespace swarmtalk::drivers {
namespace {

struct Cause {
  std::uint64_t LinkCounters::*counter;
  const char* what;  // and the remedy
};

constexpr std::array<Cause, 8> kList{{
    {&LinkCounters::frames_sealed,
     "sealed with a swarm key, and this link has none; give it the swarm's key_file, or nobody"},
    {&LinkCounters::frames_without_key,
     "not sealed, and this link has a key; give every robot the key_file"},
    {&LinkCounters::frames_other_key,
     "sealed with another swarm key; give every robot the same key_file"},
    {&LinkCounters::frames_not_authentic, "damaged or forged"},
    {&LinkCounters::frames_not_fresh,
     "sealed, and without a nonce: of a robot with check_freshness = false; make all "
     "robots the same"},
    {&LinkCounters::frames_other_version,
     "of another version of the air frame; install one release on every robot"},
    {&LinkCounters::frames_other_profile,
     "of another profile; give this link the same profile on every robot"},
    {&LinkCounters::frames_tagged,
     "tagged for another VLAN; bring every robot into one VLAN, or name that VLAN's interface"},
}};

}  // namespace

std::vector<std::string> UnreadableFrames::news(const LinkCounters& counters, MonotonicTime now) {
  static_assert(kList.size() == kCauses, "each cause has its place in told_");
  seen_ = total(counters);
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < kCauses; ++i) {
    const std::uint64_t count = counters.*kList[i].counter;
    Told& told = told_[i];
    if (count == told.count || (told.count != 0 && now - told.at < kInterval)) continue;
    const std::uint64_t fresh = count - told.count;
    lines.push_back(std::to_string(fresh) + (fresh == 1 ? " frame was " : " frames were ") +
                    kList[i].what);
    told = {count, now};
  }
  return lines;
}

}  // namespace swarmtalk::drivers
