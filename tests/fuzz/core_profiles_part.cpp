// One part of fuzz_core_profiles' profiles: SWARMTALK_FUZZ_PART says which.
#include <utility>

#include "tests/fuzz/core_node_driver.hpp"
#include "tests/fuzz/core_profiles.hpp"
#include "tests/fuzz/generated_profile.hpp"

namespace swarmtalk::core::fuzz {
namespace {

template <class... Profiles>
struct Hard {};
/// Some for each part.
template <unsigned kPart>
struct HardOf;
template <>
struct HardOf<0> {
  using Type = Hard<Shortened<Kilobot, 20, 0>, LongPackets>;
};
template <>
struct HardOf<1> {
  using Type = Hard<Shortened<Kilobot, 32, 16>, testing::UnmarkedLengths>;
};
template <>
struct HardOf<2> {
  using Type = Hard<Shortened<Footbot, 32, 0>, SmallWifi<0>>;
};
template <>
struct HardOf<3> {
  using Type = Hard<Shortened<Footbot, 7, 16>, SmallWifi<16>>;
};

template <uint32_t kFirst, class... Profiles, uint32_t... kSeeds>
void run(Hard<Profiles...>, std::integer_sequence<uint32_t, kSeeds...>, const uint8_t* bytes,
         size_t size) {
  run_one_of<Profiles..., Generated<kFirst + kSeeds>...>(bytes, size);
}

}  // namespace

template <unsigned kPart>
void run_part(const uint8_t* bytes, size_t size) {
  run<kPart * kDrawnInPart>(typename HardOf<kPart>::Type{},
                            std::make_integer_sequence<uint32_t, kDrawnInPart>{}, bytes, size);
}
template void run_part<SWARMTALK_FUZZ_PART>(const uint8_t*, size_t);

}  // namespace swarmtalk::core::fuzz
