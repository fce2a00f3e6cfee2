#include "frame/swarm_key.hpp"

#include <sodium.h>

#include <algorithm>
#include <new>
#include <stdexcept>
#include <string_view>

namespace swarmtalk::frame {
namespace {

constexpr std::string_view kIdText = "swarmtalk key id";
constexpr std::size_t kDigestBytes = 32;

}  // namespace

SwarmKey::SwarmKey(std::span<const std::uint8_t, kBytes> bytes) {
  if (sodium_init() < 0) throw std::runtime_error("libsodium cannot start");
  bytes_ = static_cast<std::uint8_t*>(sodium_malloc(kBytes));
  if (bytes_ == nullptr) throw std::bad_alloc();
  std::copy(bytes.begin(), bytes.end(), bytes_);
  sodium_mprotect_readonly(bytes_);
  std::array<std::uint8_t, kDigestBytes> digest;
  crypto_generichash(digest.data(), digest.size(),
                     reinterpret_cast<const std::uint8_t*>(kIdText.data()), kIdText.size(), bytes_,
                     kBytes);
  std::copy_n(digest.begin(), id_.size(), id_.begin());
}

SwarmKey::~SwarmKey() {
  sodium_free(bytes_);
}

}  // namespace swarmtalk::frame
