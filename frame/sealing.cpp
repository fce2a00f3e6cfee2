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

ParseResult result_of(Freshness::Verdict verdict) {
  switch (verdict) {
    case Freshness::Verdict::kFresh:
      break;
    case Freshness::Verdict::kMalformed:
      return ParseResult::kTruncated;
    case Freshness::Verdict::kNotProven:
      return ParseResult::kNotProven;
    case Freshness::Verdict::kReplayed:
      return ParseResult::kReplayed;
    case Freshness::Verdict::kTooOld:
      return ParseResult::kTooOld;
  }
  return ParseResult::kOk;
}

}  // namespace

Freshness::Voice voice_of(const SealSession& session, std::uint32_t epoch) {
  Freshness::Voice voice{};
  auto out = std::copy(session.begin(), session.end(), voice.begin());
  for (int shift = 24; shift >= 0; shift -= 8) *out++ = static_cast<std::uint8_t>(epoch >> shift);
  return voice;
}

void draw_random(std::span<std::uint8_t> out) {
  randombytes_buf(out.data(), out.size());
}

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
    return !heard.window.was_heard(counter);
  }
  return true;
}

void ReplayWindow::remember(const Id& id, std::uint32_t counter) {
  ++uses_;
  for (Heard& heard : sessions_) {
    if (heard.id != id) continue;
    heard.last_used = uses_;
    heard.window.remember(counter);
    return;
  }
  const Heard heard{id, CounterWindow::with(counter), uses_};
  if (sessions_.size() < kSessions) {
    sessions_.push_back(heard);
    return;
  }
  *std::min_element(sessions_.begin(), sessions_.end(), [](const Heard& a, const Heard& b) {
    return a.last_used < b.last_used;
  }) = heard;
}

Freshness::Voice Opener::voice_in(std::span<const std::uint8_t> bytes) {
  Freshness::Voice voice{};
  const auto out = std::copy_n(bytes.begin() + kSessionAt, kSessionBytes, voice.begin());
  std::copy_n(bytes.begin() + kEpochAt, 4, out);
  return voice;
}

ParseResult Opener::open(std::span<const std::uint8_t> bytes, Frame& frame, Freshness::Ms at) {
  SealedFrame sealed;
  const ParseResult result = parse(bytes, frame, &sealed);
  if (result == ParseResult::kSealed && key_ != nullptr) {
    return open_sealed(bytes, sealed, frame, at);
  }
  if (result == ParseResult::kOk && key_ != nullptr) return ParseResult::kWithoutKey;
  return result;
}

const SwarmKey* Opener::key_of(std::span<const std::uint8_t> bytes) const {
  for (const SwarmKey* key : {key_.get(), also_.get()}) {
    if (key != nullptr &&
        std::equal(key->id().begin(), key->id().end(), bytes.begin() + kKeyIdAt)) {
      return key;
    }
  }
  return nullptr;
}

ParseResult Opener::open_sealed(std::span<const std::uint8_t> bytes, const SealedFrame& sealed,
                                Frame& frame, Freshness::Ms at) {
  const SwarmKey* const key = key_of(bytes);
  if (key == nullptr) return ParseResult::kOtherKey;
  const std::uint32_t counter = frame.header.counter;
  const ReplayWindow::Id id = id_of(bytes);
  const bool is_own = own_ != SealSession{} && std::equal(own_.begin(), own_.end(), id.begin());
  const bool was_heard = freshness_ != nullptr ? freshness_->was_heard(voice_in(bytes), counter)
                                               : !window_.is_fresh(id, counter);
  if (is_own || (was_heard && !takes_repeats_)) return ParseResult::kReplayed;
  if (freshness_ != nullptr && !sealed.is_fresh) return ParseResult::kNotFresh;
  if (!decrypt(bytes, sealed, *key, plaintext_)) return ParseResult::kNotAuthentic;
  std::size_t used = 0;
  if (freshness_ == nullptr) {
    if (!was_heard) window_.remember(id, counter);
    if (sealed.is_fresh && !Freshness::skip(plaintext_, used)) return ParseResult::kTruncated;
  } else if (const ParseResult judged = judge(bytes, counter, at, used);
             judged != ParseResult::kOk) {
    return judged;
  }
  const std::span<const std::uint8_t> rest = std::span(plaintext_).subspan(used);
  if (sealed.has_pose && rest.size() < kPoseBytes) return ParseResult::kTruncated;
  sealed.read_plaintext(rest, frame);
  return ParseResult::kOk;
}

bool Opener::decrypt(std::span<const std::uint8_t> bytes, const SealedFrame& sealed,
                     const SwarmKey& key, std::vector<std::uint8_t>& plaintext) {
  const Nonce nonce = nonce_of(bytes);
  plaintext.resize(sealed.ciphertext.size());
  return crypto_aead_xchacha20poly1305_ietf_decrypt_detached(
             plaintext.data(), nullptr, sealed.ciphertext.data(), sealed.ciphertext.size(),
             sealed.tag.data(), bytes.data(), kSealedHeaderBytes, nonce.data(), key.bytes()) == 0;
}

bool Opener::may_be_proven(std::span<const std::uint8_t> bytes, Freshness::Ms at) const {
  return freshness_ != nullptr && freshness_->may_be_proven(voice_in(bytes), at);
}

ParseResult Opener::open_held(std::span<const std::uint8_t> bytes, Frame& frame, Freshness::Ms at) {
  SealedFrame sealed;
  const ParseResult result = parse(bytes, frame, &sealed);
  if (result != ParseResult::kSealed || freshness_ == nullptr) return ParseResult::kNotFresh;
  const SwarmKey* const key = key_of(bytes);
  if (key == nullptr) return ParseResult::kOtherKey;  // it was changed meanwhile
  if (!decrypt(bytes, sealed, *key, held_plaintext_)) return ParseResult::kNotAuthentic;
  std::size_t used = 0;
  const ParseResult judged = result_of(
      freshness_->judge_held(voice_in(bytes), frame.header.counter, held_plaintext_, at, used));
  if (judged != ParseResult::kOk) return judged;
  const std::span<const std::uint8_t> rest = std::span(held_plaintext_).subspan(used);
  if (sealed.has_pose && rest.size() < kPoseBytes) return ParseResult::kTruncated;
  sealed.read_plaintext(rest, frame);
  return ParseResult::kOk;
}

ParseResult Opener::judge(std::span<const std::uint8_t> bytes, std::uint32_t counter,
                          Freshness::Ms at, std::size_t& used) {
  return result_of(freshness_->receive(voice_in(bytes), counter, plaintext_, at, used));
}

}  // namespace swarmtalk::frame
