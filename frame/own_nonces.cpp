#include "frame/own_nonces.hpp"

#include <algorithm>

namespace swarmtalk::frame {
namespace {

OwnNonces::Ms age(OwnNonces::Ms then, OwnNonces::Ms now) {
  return now > then ? now - then : 0;
}

}  // namespace

void OwnNonces::roll(Ms now, const Draw& draw, Ms least_age) {
  if (!drawn_.empty() && age(drawn_.back().at, now) < least_age) return;
  if (drawn_.size() == kKept) drawn_.erase(drawn_.begin());
  Drawn made{{}, now};
  draw(made.bytes);
  drawn_.push_back(made);
}

std::optional<OwnNonces::Ms> OwnNonces::proof_in(std::span<const std::uint8_t> answers,
                                                 Ms at) const {
  for (auto nonce = drawn_.rbegin(); nonce != drawn_.rend(); ++nonce) {
    if (age(nonce->at, at) > kAnswerMs) break;
    for (std::size_t i = 0; i + nonce->bytes.size() <= answers.size(); i += nonce->bytes.size()) {
      if (std::equal(nonce->bytes.begin(), nonce->bytes.end(),
                     answers.begin() + static_cast<std::ptrdiff_t>(i))) {
        return std::min(nonce->at, at);
      }
    }
  }
  return std::nullopt;
}

}  // namespace swarmtalk::frame
