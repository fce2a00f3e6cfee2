// Where the judge's images are, and why one is missing.
#pragma once

#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

namespace swarmtalk::judge {

enum class Maker { kOurs, kKilolib };

inline std::string to_text(Maker maker) {
  return maker == Maker::kOurs ? "ours" : "kilolib";
}

inline void PrintTo(Maker maker, std::ostream* out) {
  *out << to_text(maker);
}

/// Those whose images this build makes.
inline std::vector<Maker> makers() {
#ifdef SWARMTALK_HAS_KILOLIB
  return {Maker::kOurs, Maker::kKilolib};
#else
  return {Maker::kOurs};
#endif
}

inline std::string image_of(const std::string& name) {
#ifdef SWARMTALK_FIRMWARE_IMAGES
  return SWARMTALK_FIRMWARE_IMAGES + name + ".elf";
#else
  return name + ".elf";
#endif
}

inline std::string probe_of(Maker maker) {
  return image_of(maker == Maker::kOurs ? "probe" : "probe_kilolib");
}

/// Empty if the maker's images are there, else why they are not.
inline std::string missing(Maker maker) {
  if (std::filesystem::exists(probe_of(maker))) return "";
  return maker == Maker::kOurs
             ? "the Kilobot images are not built: apt-get install gcc-avr avr-libc"
             : "no kilolib: give its folder with -DKILOLIB=";
}

}  // namespace swarmtalk::judge
