// Freshness: whether a sealed frame is of now (docs/wire-format.md, fresh frames). A key alone says
// that a robot of the swarm made a frame, not when. Each robot puts a nonce of its own into its
// frames, a new one every second, and sends back the nonces of others: who finds its own nonce in a
// frame knows that the frame, and the session it is of, is younger than the nonce. From there
// stamps tell the age of each frame. One for each link with a key, on the link's thread. Reads no
// clock: times are milliseconds of one monotonic clock, of arrivals as the kernel has stamped them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "frame/air_frame.hpp"
#include "frame/own_nonces.hpp"
#include "frame/voices.hpp"

namespace swarmtalk::frame {

class Freshness {
 public:
  using Ms = std::uint64_t;
  using Nonce = OwnNonces::Nonce;
  using Voice = frame::Voice;
  using Draw = OwnNonces::Draw;

  enum class Verdict : std::uint8_t {
    kFresh,
    kMalformed,  // its first bytes are not what they have to be
    kNotProven,  // of a voice that has not shown yet that it is alive
    kReplayed,   // heard before, or too far behind to tell
    kTooOld,     // held back for longer than kBoundMs
  };

  static constexpr std::size_t kLeastBytes = kFreshBytes;  // stamp, nonce, mark
  static constexpr std::size_t kAnswerBytes = 6;
  static constexpr std::size_t kAskBytes = 2;

  /// A frame that may have been under way for longer is dropped. What is not known for sure counts
  /// as waiting: of the bound the nonce's own way takes up to OwnNonces::kAnswerMs.
  static constexpr Ms kBoundMs = 5000;
  static constexpr Ms kRenewMs = 300'000;   // who was proven so long ago is asked again
  static constexpr Ms kTrustMs = 900'000;   // ... and not believed any more
  static constexpr Ms kEagerMs = 5000;      // after a start nonces are sent back unasked
  static constexpr Ms kGapMs = 100;         // between frames that are sent for this alone
  static constexpr Ms kSilenceMs = 60'000;  // a robot says at least so often that it is there
  static constexpr std::size_t kVoices = Voices::kMostProven;        // that are remembered
  static constexpr std::size_t kStrangers = Voices::kMostStrangers;  // that were heard lately

  /// @param own  our own voice
  Freshness(const Voice& own, Ms now, Draw draw);

  /// Another session of ours: it is another voice. Who was proven stays so.
  void change_own(const Voice& own, Ms now);

  /// Writes what goes in front of pose and packets. @param room  at least kLeastBytes
  /// @return bytes written; more than kLeastBytes only if somebody is to be asked or answered
  std::size_t write(Ms now, std::span<std::uint8_t> room);

  /// Bytes that write() would like to have now.
  std::size_t wanted_bytes(Ms now) const;

  /// Whether a frame is known to be a replay before anything of it is decrypted.
  bool was_heard(const Voice& voice, std::uint32_t counter) const;

  /// Judges a frame that is authentic. @param at  its arrival, when the kernel took it
  /// @param plaintext  of the frame. @param used  set to the bytes that are ours, if not kMalformed
  Verdict receive(const Voice& voice, std::uint32_t counter,
                  std::span<const std::uint8_t> plaintext, Ms at, std::size_t& used);

  /// Judges a frame that receive() has found not proven, once its voice is: it is fresh if it came
  /// before the frame that proved it, and was sent neither too long ago nor before this robot began
  /// to remember what it hears. Each frame once, and none while receive() has not proved the voice.
  /// @param at  now: the arrival of the frame that proved it. @param used  as for receive()
  Verdict judge_held(const Voice& voice, std::uint32_t counter,
                     std::span<const std::uint8_t> plaintext, Ms at, std::size_t& used) const;

  /// Whether the last receive() found a proof.
  bool has_proven() const { return has_proven_; }

  /// Whether a frame that is not proven may soon be: its voice was heard for the first time lately.
  bool may_be_proven(const Voice& voice, Ms at) const;

  /// How much of a plaintext is ours. @return false: malformed
  static bool skip(std::span<const std::uint8_t> plaintext, std::size_t& used);

  /// When a frame should leave, with or without packets, so that others and we believe each other.
  Ms speak_at() const { return speak_at_; }
  /// None could leave.
  void postpone(Ms now) { speak_at_ = now + kGapMs; }

  std::size_t proven() const { return voices_.proven().size(); }
  /// Proven voices that made place for others, because more than kVoices were.
  std::uint64_t evicted() const { return voices_.evicted(); }

 private:
  void meet(HeardVoice& other, const Nonce& nonce, std::span<const std::uint8_t> asks,
            bool is_believed, Ms at);
  Verdict judge(ProvenVoice& voice, std::uint32_t counter, std::uint32_t stamp, Ms at);
  bool is_answer_due(const HeardVoice& other, Ms now) const;
  bool is_ask_due(const HeardVoice& other, Ms now) const;
  bool is_renewal_due(const ProvenVoice& other, Ms now) const;
  void speak_by(Ms when);

  Voice own_;
  Draw draw_;
  Ms began_at_;
  OwnNonces nonces_;
  Voices voices_;
  std::size_t next_answer_ = 0;  // strangers take turns
  Ms last_written_at_ = 0;
  bool has_written_ = false;
  Ms speak_at_;
  bool has_proven_ = false;
};

}  // namespace swarmtalk::frame
