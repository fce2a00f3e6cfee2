#include "frame/sealing.hpp"

#include <sodium.h>

#include <algorithm>
#include <utility>

namespace swarmtalk::frame {
namespace {

static_assert(crypto_aead_xchacha20poly1305_ietf_KEYBYTES == SwarmKey::kBytes);
static_assert(crypto_aead_xchacha20poly1305_ietf_ABYTES == kTagBytes);

using Nonce = std::array<std::uint8_t, crypto_aead_xchacha20poly1305_ietf_NPUBBYTES>;

// @param frame  at least kSealedHeaderBytes
ReplayWindow::Id id_of(std::span<const std::uint8_t> frame) {
  ReplayWindow::Id id;
  auto out = std::copy_n(frame.begin() + kSessionAt, kSessionBytes, id.begin());
  out = std::copy_n(frame.begin() + kEpochAt, 4, out);
  std::copy_n(frame.begin() + kNodeAt, 2, out);
  return id;
}

Nonce nonce_of(std::span<const std::uint8_t> frame) {
  Nonce nonce{};
  auto out = std::copy_n(frame.begin() + kSessionAt, kSessionBytes, nonce.begin());
  out = std::copy_n(frame.begin() + kEpochAt, 4, out);
  out = std::copy_n(frame.begin() + kCounterAt, 4, out);
  std::copy_n(frame.begin() + kNodeAt, 2, out);
  return nonce;
}

}  // namespace

Sealer::Sealer(std::shared_ptr<const SwarmKey> key) : key_(std::move(key)) {
  draw_session();
}

Sealer::Sealer(std::shared_ptr<const SwarmKey> key, const SealSession& session)
    : key_(std::move(key)), session_(session) {}

void Sealer::draw_session() {
  randombytes_buf(session_.data(), session_.size());
}

void Sealer::seal(std::span<std::uint8_t> frame) const {
  std::copy(key_->id().begin(), key_->id().end(), frame.begin() + kKeyIdAt);
  std::copy(session_.begin(), session_.end(), frame.begin() + kSessionAt);
  const Nonce nonce = nonce_of(frame);
  const std::size_t plain_bytes = frame.size() - kSealedHeaderBytes - kTagBytes;
  std::uint8_t* const plain = frame.data() + kSealedHeaderBytes;
  crypto_aead_xchacha20poly1305_ietf_encrypt_detached(plain, plain + plain_bytes, nullptr, plain,
                                                      plain_bytes, frame.data(), kSealedHeaderBytes,
                                                      nullptr, nonce.data(), key_->bytes());
}

bool ReplayWindow::is_fresh(const Id& id, std::uint32_t counter) const {
  for (const Heard& heard : sessions_) {
    if (heard.id != id) continue;
    if (counter > heard.newest) return true;
    const std::uint32_t behind = heard.newest - counter;
    return behind < kFrames && (heard.seen >> behind & 1) == 0;
  }
  return true;
}

void ReplayWindow::remember(const Id& id, std::uint32_t counter) {
  ++uses_;
  for (Heard& heard : sessions_) {
    if (heard.id != id) continue;
    heard.last_used = uses_;
    if (counter > heard.newest) {
      const std::uint32_t step = counter - heard.newest;
      heard.seen = step < kFrames ? heard.seen << step : 0;
      heard.newest = counter;
    }
    heard.seen |= std::uint64_t{1} << (heard.newest - counter);
    return;
  }
  const Heard heard{id, counter, 1, uses_};
  if (sessions_.size() < kSessions) {
    sessions_.push_back(heard);
    return;
  }
  *std::min_element(sessions_.begin(), sessions_.end(), [](const Heard& a, const Heard& b) {
    return a.last_used < b.last_used;
  }) = heard;
}

ParseResult Opener::open(std::span<const std::uint8_t> bytes, Frame& frame) {
  SealedFrame sealed;
  const ParseResult result = parse(bytes, frame, &sealed);
  if (result == ParseResult::kSealed && key_ != nullptr) return open_sealed(bytes, sealed, frame);
  if (result == ParseResult::kOk && key_ != nullptr) return ParseResult::kWithoutKey;
  return result;
}

ParseResult Opener::open_sealed(std::span<const std::uint8_t> bytes, const SealedFrame& sealed,
                                Frame& frame) {
  if (!std::equal(key_->id().begin(), key_->id().end(), bytes.begin() + kKeyIdAt)) {
    return ParseResult::kOtherKey;
  }
  const ReplayWindow::Id id = id_of(bytes);
  const bool is_own = own_ != SealSession{} && std::equal(own_.begin(), own_.end(), id.begin());
  if (is_own || !window_.is_fresh(id, frame.header.counter)) return ParseResult::kReplayed;
  const Nonce nonce = nonce_of(bytes);
  plaintext_.resize(sealed.ciphertext.size());
  if (crypto_aead_xchacha20poly1305_ietf_decrypt_detached(
          plaintext_.data(), nullptr, sealed.ciphertext.data(), sealed.ciphertext.size(),
          sealed.tag.data(), bytes.data(), kSealedHeaderBytes, nonce.data(), key_->bytes()) != 0) {
    return ParseResult::kNotAuthentic;
  }
  window_.remember(id, frame.header.counter);
  sealed.read_plaintext(plaintext_, frame);
  return ParseResult::kOk;
}

}  // namespace swarmtalk::frame
