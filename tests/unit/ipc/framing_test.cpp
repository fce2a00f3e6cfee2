#include "ipc/framing.hpp"

#include <google/protobuf/stubs/logging.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <new>
#include <random>
#include <sstream>
#include <string>
#include <vector>

// Counts what the code under test allocates; the whole program goes through it.
static std::size_t allocation_count = 0;

void* operator new(std::size_t size) {
  ++allocation_count;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace swarmtalk::ipc {
namespace {

Envelope publication(std::uint64_t number, std::size_t size_bytes) {
  Envelope envelope;
  Publish* publish = envelope.mutable_publish();
  publish->set_publisher_id(1);
  publish->set_publish_number(number);
  publish->set_payload(std::string(size_bytes, static_cast<char>(number)));
  return envelope;
}

std::string frame(const Envelope& envelope) {
  std::string bytes;
  EXPECT_TRUE(append_frame(envelope, bytes));
  return bytes;
}

void feed(FrameReader& reader, const char* bytes, std::size_t size_bytes) {
  auto room = reader.prepare(size_bytes);
  ASSERT_GE(room.size(), size_bytes);
  std::memcpy(room.data(), bytes, size_bytes);
  reader.commit(size_bytes);
}

void feed(FrameReader& reader, const std::string& bytes) {
  feed(reader, bytes.data(), bytes.size());
}

TEST(Framing, FrameIsLittleEndianLengthThenEnvelope) {
  Envelope envelope;
  envelope.set_request_id(7);
  envelope.mutable_get_pose();
  const std::string bytes = frame(envelope);
  // Field 1 varint 7; field 17 (tag 0x8a 0x01), length 0.
  EXPECT_EQ(bytes, std::string("\x05\x00\x00\x00\x08\x07\x8a\x01\x00", 9));
}

// The example in docs/ipc.md: lines that begin with client or daemon, hex digits up to a '#'.
TEST(Framing, DocumentedExampleIsTheProtocol) {
  std::ifstream document(SWARMTALK_SOURCE_DIR "/docs/ipc.md");
  ASSERT_TRUE(document) << "docs/ipc.md is missing";
  int frames = 0;
  bool is_code = false;
  for (std::string line; std::getline(document, line);) {
    if (line.starts_with("```")) is_code = !is_code;
    if (!is_code) continue;
    if (!line.starts_with("client ") && !line.starts_with("daemon ")) continue;
    std::istringstream words(line.substr(7, line.find('#') - 7));
    std::string bytes;
    for (std::string word; words >> word;) {
      bytes += static_cast<char>(std::stoi(word, nullptr, 16));
    }
    FrameReader reader;
    Envelope envelope;
    feed(reader, bytes);
    ASSERT_EQ(reader.next(envelope), ReadResult::kEnvelope) << line;
    EXPECT_EQ(count_bodies(envelope), 1) << line;
    EXPECT_EQ(frame(envelope), bytes) << line;
    ++frames;
  }
  EXPECT_EQ(frames, 12);
}

TEST(FrameReader, ReadsTwoFramesSplitAtAnyByte) {
  const std::string bytes = frame(publication(1, 40)) + frame(publication(2, 3));
  for (std::size_t split = 0; split <= bytes.size(); ++split) {
    FrameReader reader;
    Envelope envelope;
    std::vector<std::uint64_t> numbers;
    for (const std::string& part : {bytes.substr(0, split), bytes.substr(split)}) {
      feed(reader, part);
      while (reader.next(envelope) == ReadResult::kEnvelope) {
        numbers.push_back(envelope.publish().publish_number());
      }
    }
    EXPECT_EQ(numbers, (std::vector<std::uint64_t>{1, 2})) << "split at " << split;
  }
}

TEST(FrameReader, ReadsAFrameThatComesByteByByte) {
  const std::string bytes = frame(publication(9, 100));
  FrameReader reader;
  Envelope envelope;
  for (std::size_t i = 0; i + 1 < bytes.size(); ++i) {
    feed(reader, &bytes[i], 1);
    ASSERT_EQ(reader.next(envelope), ReadResult::kNeedMore) << "byte " << i;
  }
  feed(reader, &bytes.back(), 1);
  ASSERT_EQ(reader.next(envelope), ReadResult::kEnvelope);
  EXPECT_EQ(envelope.publish().payload().size(), 100u);
}

TEST(FrameReader, ReadsManyFramesFromOneRead) {
  std::string bytes;
  for (std::uint64_t number = 1; number <= 500; ++number) {
    ASSERT_TRUE(append_frame(publication(number, number % 50), bytes));
  }
  FrameReader reader;
  Envelope envelope;
  feed(reader, bytes);
  for (std::uint64_t number = 1; number <= 500; ++number) {
    ASSERT_EQ(reader.next(envelope), ReadResult::kEnvelope);
    ASSERT_EQ(envelope.publish().publish_number(), number);
    ASSERT_EQ(envelope.publish().payload().size(), number % 50);
  }
  EXPECT_EQ(reader.next(envelope), ReadResult::kNeedMore);
}

TEST(FrameReader, ReadsTheLongestEnvelope) {
  std::size_t size_bytes = kMaxEnvelopeBytes;
  while (publication(1, size_bytes).ByteSizeLong() > kMaxEnvelopeBytes) --size_bytes;
  const Envelope longest = publication(1, size_bytes);
  ASSERT_EQ(longest.ByteSizeLong(), kMaxEnvelopeBytes);
  FrameReader reader;
  Envelope envelope;
  feed(reader, frame(longest));
  EXPECT_EQ(reader.next(envelope), ReadResult::kEnvelope);
  EXPECT_EQ(envelope.publish().payload().size(), size_bytes);
}

TEST(FrameReader, RefusesLengthZero) {
  FrameReader reader;
  Envelope envelope;
  feed(reader, std::string(4, '\0'));
  EXPECT_EQ(reader.next(envelope), ReadResult::kMalformed);
}

TEST(FrameReader, RefusesLengthOverTheLimitBeforeTheBodyArrives) {
  FrameReader reader;
  Envelope envelope;
  feed(reader, std::string("\x01\x00\x01\x00", 4));  // 65537
  EXPECT_EQ(reader.next(envelope), ReadResult::kMalformed);
}

TEST(FrameReader, RefusesABodyThatIsNoEnvelope) {
  FrameReader reader;
  Envelope envelope;
  feed(reader, std::string("\x03\x00\x00\x00\xff\xff\xff", 7));
  EXPECT_EQ(reader.next(envelope), ReadResult::kMalformed);
}

TEST(FrameReader, SurvivesRandomBytes) {
  std::mt19937 random(20);
  for (int round = 0; round < 2000; ++round) {
    FrameReader reader;
    Envelope envelope;
    std::string bytes(random() % 64, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    if (bytes.size() > 4) {  // often a plausible length, so that the body is parsed
      bytes[0] = static_cast<char>(bytes.size() - 4);
      bytes[1] = bytes[2] = bytes[3] = '\0';
    }
    feed(reader, bytes);
    while (reader.next(envelope) == ReadResult::kEnvelope) {
    }
  }
}

TEST(FrameReader, StartsAfreshAfterClear) {
  FrameReader reader;
  Envelope envelope;
  feed(reader, frame(publication(1, 10)).substr(0, 7));
  reader.clear();
  feed(reader, frame(publication(2, 10)));
  ASSERT_EQ(reader.next(envelope), ReadResult::kEnvelope);
  EXPECT_EQ(envelope.publish().publish_number(), 2u);
}

TEST(FrameReader, ParsingReplacesTheOldContent) {
  FrameReader reader;
  Envelope envelope;
  envelope.mutable_hello()->set_name("old");
  feed(reader, frame(publication(1, 1)));
  ASSERT_EQ(reader.next(envelope), ReadResult::kEnvelope);
  EXPECT_FALSE(envelope.has_hello());
  EXPECT_EQ(count_bodies(envelope), 1);
}

TEST(Framing, SteadyStateAllocatesNothing) {
  FrameReader reader;
  Envelope incoming;
  Envelope outgoing = publication(1, 200);
  std::string buffer;
  const auto round_trip = [&] {
    buffer.clear();
    for (int i = 0; i < 8; ++i) append_frame(outgoing, buffer);
    // Two reads, the second starts inside a frame.
    for (std::size_t at : {std::size_t{0}, buffer.size() / 2 + 3}) {
      const std::size_t stop = at == 0 ? buffer.size() / 2 + 3 : buffer.size();
      auto room = reader.prepare(4096);
      std::memcpy(room.data(), buffer.data() + at, stop - at);
      reader.commit(stop - at);
      while (reader.next(incoming) == ReadResult::kEnvelope) {
      }
    }
  };
  for (int i = 0; i < 10; ++i) round_trip();
  const std::size_t before = allocation_count;
  for (int i = 0; i < 1000; ++i) round_trip();
  EXPECT_EQ(allocation_count, before);
}

TEST(AppendFrame, RefusesAnEnvelopeOverTheLimitAndLeavesTheBuffer) {
  std::string buffer = "before";
  EXPECT_FALSE(append_frame(publication(1, kMaxEnvelopeBytes), buffer));
  EXPECT_EQ(buffer, "before");
}

TEST(AppendFrame, RefusesAnEmptyEnvelope) {
  std::string buffer;
  EXPECT_FALSE(append_frame(Envelope(), buffer));
  EXPECT_TRUE(buffer.empty());
}

// In a lite build it does not name the message.
TEST(Parse, CanBeToldFromOtherUsesOfProtobufByWhatProtobufLogs) {
  static int inside, outside;
  inside = outside = 0;
  auto* const before = google::protobuf::SetLogHandler(
      [](google::protobuf::LogLevel, const char*, int, const std::string&) {
        ++(is_inside_protobuf() ? inside : outside);
      });
  const std::string no_text = "\x2a\x05\x0a\x03\x0a\x01\xff";  // as the name of a channel
  Envelope envelope;
  EXPECT_FALSE(parse(no_text, envelope));
  EXPECT_GT(inside, 0);
  EXPECT_EQ(outside, 0);
  EXPECT_FALSE(envelope.ParseFromString(no_text));
  EXPECT_GT(outside, 0);
  google::protobuf::SetLogHandler(before);
  EXPECT_FALSE(is_inside_protobuf());
}

TEST(CountBodies, CountsEverySubmessageButNotTheRequestId) {
  Envelope envelope;
  envelope.set_request_id(1);
  EXPECT_EQ(count_bodies(envelope), 0);
  const auto* descriptor = Envelope::descriptor();
  int submessages = 0;
  for (int i = 0; i < descriptor->field_count(); ++i) {
    const auto* field = descriptor->field(i);
    if (field->cpp_type() != google::protobuf::FieldDescriptor::CPPTYPE_MESSAGE) continue;
    envelope.GetReflection()->MutableMessage(&envelope, field);
    EXPECT_EQ(count_bodies(envelope), ++submessages) << field->name();
  }
}

}  // namespace
}  // namespace swarmtalk::ipc
