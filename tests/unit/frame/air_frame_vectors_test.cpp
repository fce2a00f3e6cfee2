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

Vector parse_good(std::istream& line, bool is_sealed) {
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
      packets >> frame;
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
    if (kind == "good" || kind == "sealed") {
      vectors.push_back(parse_good(line, kind == "sealed"));
    } else {
      Vector vector;
      std::string key, frame;
      line >> vector.name >> vector.counter;
      if (kind == "refused") line >> key;
      line >> frame;
      vector.key = key_from_hex(key);
      vector.frame = from_hex(frame);
      vectors.push_back(vector);
    }
  }
  return vectors;
}

TEST(AirFrameVectors, GoodFramesAreReadFieldByField) {
  const std::vector<Vector> vectors = read_vectors("good");
  ASSERT_GE(vectors.size(), 10U);
  for (const Vector& vector : vectors) {
    SCOPED_TRACE(vector.name);
    Frame frame;
    ASSERT_EQ(parse(vector.frame, frame), ParseResult::kOk);
    EXPECT_EQ(frame.header, vector.header);
    std::vector<Bytes> packets;
    PacketReader reader(frame.packets);
    for (std::span<const std::uint8_t> packet; reader.next(packet);) {
      packets.emplace_back(packet.begin(), packet.end());
    }
    EXPECT_EQ(packets, vector.packets);
    EXPECT_FALSE(reader.is_malformed());
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

TEST(AirFrameVectors, FramesAgainstTheKeysRulesAreRefusedUnderTheCounterOfThePage) {
  const std::vector<Vector> vectors = read_vectors("refused");
  ASSERT_GE(vectors.size(), 15U);
  for (const Vector& vector : vectors) {
    SCOPED_TRACE(vector.name);
    Frame frame;
    EXPECT_EQ(counter_name(Opener(vector.key).open(vector.frame, frame)), vector.counter);
  }
}

}  // namespace
}  // namespace swarmtalk::frame
