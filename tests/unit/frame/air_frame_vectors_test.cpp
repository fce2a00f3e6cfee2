// The vectors of tests/vectors/air_frames.txt, read and written.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "frame/air_frame.hpp"
#include "frame/sealing.hpp"

namespace swarmtalk::frame {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct Vector {
  std::string name;
  std::shared_ptr<const SwarmKey> key;  // sealed, refused
  SealSession session{};
  std::string counter;  // empty: good
  FrameHeader header;
  std::vector<Bytes> packets;
  Bytes fresh;  // of a fresh frame: what is in front of its pose
  Bytes frame;
};

Bytes from_hex(const std::string& text) {
  Bytes bytes;
  if (text == "-") return bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(text.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream stream(text == "-" ? "" : text);
  for (std::string part; std::getline(stream, part, ',');) parts.push_back(part);
  return parts;
}

std::shared_ptr<const SwarmKey> key_from_hex(const std::string& text) {
  const Bytes bytes = from_hex(text);
  if (bytes.size() != SwarmKey::kBytes) return nullptr;
  return std::make_shared<SwarmKey>(std::span(bytes).first<SwarmKey::kBytes>());
}

/// Stamp, nonce, asks and answers as the page has them.
Bytes parse_fresh(std::istream& line) {
  unsigned long stamp = 0;
  std::string nonce, asks, answers;
  line >> stamp >> nonce >> asks >> answers;
  Bytes bytes;
  const auto append = [&bytes](const Bytes& more) {
    bytes.insert(bytes.end(), more.begin(), more.end());
  };
  for (int shift = 16; shift >= 0; shift -= 8) {
    bytes.push_back(static_cast<std::uint8_t>(stamp >> shift));
  }
  append(from_hex(nonce));
  const std::vector<std::string> asked = split(asks);
  const std::vector<std::string> answered = split(answers);
  if (asked.empty() && answered.empty()) {
    bytes.push_back(0);
    return bytes;
  }
  append({1, static_cast<std::uint8_t>(asked.size()), static_cast<std::uint8_t>(answered.size())});
  for (const std::string& each : asked) append(from_hex(each));
  for (const std::string& each : answered) append(from_hex(each));
  return bytes;
}

Vector parse_good(std::istream& line, const std::string& kind) {
  const bool is_sealed = kind != "good";
  Vector vector;
  unsigned profile = 0;
  std::string pose, packets, frame;
  line >> vector.name;
  if (is_sealed) {
    std::string key, session;
    line >> key >> session;
    vector.key = key_from_hex(key);
    const Bytes bytes = from_hex(session);
    std::copy_n(bytes.begin(), std::min(bytes.size(), kSessionBytes), vector.session.begin());
  }
  line >> profile >> vector.header.node >> vector.header.epoch >> vector.header.counter >> pose >>
      packets;
  if (kind == "fresh") vector.fresh = parse_fresh(line);
  line >> frame;
  vector.header.profile = static_cast<ProfileId>(profile);
  if (const std::vector<std::string> parts = split(pose); parts.size() == 4) {
    vector.header.pose = FramePose{static_cast<std::int16_t>(std::stoi(parts[0])),
                                   static_cast<std::int16_t>(std::stoi(parts[1])),
                                   static_cast<std::uint16_t>(std::stoul(parts[2])),
                                   static_cast<std::uint8_t>(std::stoul(parts[3]))};
  }
  for (const std::string& packet : split(packets)) vector.packets.push_back(from_hex(packet));
  vector.frame = from_hex(frame);
  return vector;
}

std::vector<Vector> read_vectors(const std::string& kind_wanted) {
  std::ifstream file(std::string(SWARMTALK_VECTORS) + "/air_frames.txt");
  std::vector<Vector> vectors;
  for (std::string text; std::getline(file, text);) {
    std::istringstream line(text);
    std::string kind;
    line >> kind;
    if (kind != kind_wanted) continue;
    if (kind == "good" || kind == "sealed" || kind == "fresh") {
      vectors.push_back(parse_good(line, kind));
    } else {
      Vector vector;
      std::string key, frame;
      line >> vector.name >> vector.counter;
      if (kind == "refused" || kind == "freshness") line >> key;
      line >> frame;
      vector.key = key_from_hex(key);
      vector.frame = from_hex(frame);
      vectors.push_back(vector);
    }
  }
  return vectors;
}

void expect_fields(const Frame& frame, const Vector& vector) {
  EXPECT_EQ(frame.header, vector.header);
  std::vector<Bytes> packets;
  PacketReader reader(frame.packets);
  for (std::span<const std::uint8_t> packet; reader.next(packet);) {
    packets.emplace_back(packet.begin(), packet.end());
  }
  EXPECT_EQ(packets, vector.packets);
  EXPECT_FALSE(reader.is_malformed());
}

TEST(AirFrameVectors, GoodFramesAreReadFieldByField) {
  const std::vector<Vector> vectors = read_vectors("good");
  ASSERT_GE(vectors.size(), 10U);
  for (const Vector& vector : vectors) {
    SCOPED_TRACE(vector.name);
    Frame frame;
    ASSERT_EQ(parse(vector.frame, frame), ParseResult::kOk);
    expect_fields(frame, vector);
  }
}

TEST(AirFrameVectors, GoodFramesAreWrittenByteForByte) {
  constexpr std::size_t kZeroAt = 7;
  for (const Vector& vector : read_vectors("good")) {
    SCOPED_TRACE(vector.name);
    Bytes buffer(2000, 0xEE);
    FrameWriter writer(buffer, vector.header, 1500);
    for (const Bytes& packet : vector.packets) ASSERT_TRUE(writer.append(packet));
    const std::span<const std::uint8_t> written = writer.finish();
    Bytes expected = vector.frame;
    ASSERT_LE(written.size(), expected.size());
    expected.resize(written.size());  // without padding
    expected[kZeroAt] = 0;
    EXPECT_EQ(Bytes(written.begin(), written.end()), expected);
  }
}

TEST(AirFrameVectors, BadFramesAreRefusedUnderTheCounterOfThePage) {
  const std::vector<Vector> vectors = read_vectors("bad");
  ASSERT_GE(vectors.size(), 20U);
  for (const Vector& vector : vectors) {
    SCOPED_TRACE(vector.name);
    Frame frame;
    const ParseResult result = parse(vector.frame, frame);
    if (vector.counter != "frames_bad_packet_length") {
      EXPECT_EQ(counter_name(result), vector.counter);
      continue;
    }
    ASSERT_EQ(result, ParseResult::kOk);
    PacketReader reader(frame.packets);
    for (std::span<const std::uint8_t> packet; reader.next(packet);) {
      EXPECT_EQ(packet.size(), 3U) << "what came before the flaw is kept";
    }
    EXPECT_TRUE(reader.is_malformed());
  }
}

TEST(AirFrameVectors, SealedFramesAreOpenedFieldByField) {
  const std::vector<Vector> vectors = read_vectors("sealed");
  ASSERT_GE(vectors.size(), 5U);
  for (const Vector& vector : vectors) {
    SCOPED_TRACE(vector.name);
    Frame frame;
    ASSERT_EQ(Opener(vector.key).open(vector.frame, frame), ParseResult::kOk);
    EXPECT_EQ(frame.header, vector.header);
    Opener opener(vector.key);
    ASSERT_EQ(opener.open(vector.frame, frame), ParseResult::kOk);
    std::vector<Bytes> packets;
    PacketReader reader(frame.packets);
    for (std::span<const std::uint8_t> packet; reader.next(packet);) {
      packets.emplace_back(packet.begin(), packet.end());
    }
    EXPECT_EQ(packets, vector.packets);
  }
}

TEST(AirFrameVectors, SealedFramesAreWrittenByteForByte) {
  for (const Vector& vector : read_vectors("sealed")) {
    SCOPED_TRACE(vector.name);
    const Sealer sealer(vector.key, vector.session);
    Bytes buffer(2000, 0xEE);
    FrameWriter writer(buffer, vector.header, 1500, &sealer);
    for (const Bytes& packet : vector.packets) ASSERT_TRUE(writer.append(packet));
    const std::span<const std::uint8_t> written = writer.finish();
    Bytes expected = vector.frame;
    ASSERT_LE(written.size(), expected.size());
    expected.resize(written.size());  // without padding
    EXPECT_EQ(Bytes(written.begin(), written.end()), expected);
  }
}

TEST(AirFrameVectors, FreshFramesAreOpenedFieldByField) {
  const std::vector<Vector> vectors = read_vectors("fresh");
  ASSERT_GE(vectors.size(), 6U);
  for (const Vector& vector : vectors) {
    SCOPED_TRACE(vector.name);
    Frame frame;
    Opener opener(vector.key);
    ASSERT_EQ(opener.open(vector.frame, frame), ParseResult::kOk);
    expect_fields(frame, vector);
  }
}

TEST(AirFrameVectors, FreshFramesAreWrittenByteForByte) {
  for (const Vector& vector : read_vectors("fresh")) {
    SCOPED_TRACE(vector.name);
    const Sealer sealer(vector.key, vector.session);
    Bytes buffer(2000, 0xEE);
    FrameWriter writer(buffer, vector.header, 1500, &sealer, vector.fresh);
    for (const Bytes& packet : vector.packets) ASSERT_TRUE(writer.append(packet));
    const std::span<const std::uint8_t> written = writer.finish();
    EXPECT_EQ(Bytes(written.begin(), written.end()), vector.frame);
  }
}

TEST(AirFrameVectors, FreshnessIsJudgedAsThePageSays) {
  const auto draw = [](std::span<std::uint8_t> out) {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<std::uint8_t>(0xC0 + i);
  };
  const std::vector<Vector> vectors = read_vectors("freshness");
  ASSERT_GE(vectors.size(), 9U);
  Freshness::Ms now = 100'000;
  const auto freshness = std::make_shared<Freshness>(voice_of({1, 2, 3, 4, 5, 6}, 1), now, draw);
  Opener opener(vectors.front().key);
  opener.check_freshness(freshness);
  for (const Vector& vector : vectors) {
    SCOPED_TRACE(vector.name);
    Frame frame;
    const std::string_view counter = counter_name(opener.open(vector.frame, frame, ++now));
    EXPECT_EQ(counter.empty() ? "-" : counter, vector.counter);
  }
}

TEST(AirFrameVectors, FramesAgainstTheKeysRulesAreRefusedUnderTheCounterOfThePage) {
  const std::vector<Vector> vectors = read_vectors("refused");
  ASSERT_GE(vectors.size(), 20U);
  for (const Vector& vector : vectors) {
    SCOPED_TRACE(vector.name);
    Frame frame;
    EXPECT_EQ(counter_name(Opener(vector.key).open(vector.frame, frame)), vector.counter);
  }
}

}  // namespace
}  // namespace swarmtalk::frame
