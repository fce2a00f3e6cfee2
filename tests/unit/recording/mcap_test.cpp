// Writer and reader together: what comes back, and what is left of a file that was cut, damaged or
// not written whole.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <vector>

#include "recording/mcap_reader.hpp"
#include "recording/mcap_writer.hpp"

namespace swarmtalk::recording {
namespace {

struct Heard {
  std::string topic;
  std::uint32_t sequence;
  std::uint64_t time_ns;
  std::string bytes;
  bool operator==(const Heard&) const = default;
};

/// A disk that takes a second longer with each write.
McapWriter::Clock::time_point later_each_time() {
  static int calls = 0;
  static McapWriter::Clock::time_point now;
  if (++calls % 2 == 0) now += std::chrono::seconds(calls / 2);
  return now;
}

class Mcap : public ::testing::Test {
 protected:
  Mcap() {
    std::string name = "/tmp/swarmtalk-mcap-XXXXXX";
    folder = ::mkdtemp(name.data());
    path = folder + "/a.mcap";
  }
  ~Mcap() override { std::filesystem::remove_all(folder); }

  static std::string file_of(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  /// A file of `chunks` chunks with `each` messages on two topics. @return them in order
  std::vector<Heard> write(int chunks, int each, bool is_finished = true) {
    std::vector<Heard> written;
    McapWriter writer;
    EXPECT_EQ(writer.open(path, "test"), "");
    const std::uint16_t schema = writer.add_schema({"s", "protobuf", "schema bytes"});
    const std::uint16_t channels[] = {writer.add_channel({schema, "/a", "protobuf", {{"k", "v"}}}),
                                      writer.add_channel({0, "/b", "json", {}})};
    std::uint32_t number = 0;
    for (int chunk = 0; chunk < chunks; ++chunk) {
      for (int i = 0; i < each; ++i) {
        ++number;
        const std::string bytes = std::string(number % 40, 'x') + std::to_string(number);
        written.push_back({number % 2 == 1 ? "/a" : "/b", number, 1000 * number, bytes});
        EXPECT_TRUE(
            writer.write({channels[number % 2 == 1 ? 0 : 1], number, 1000 * number, 0, bytes}));
      }
      EXPECT_TRUE(writer.close_chunk());
      ends.push_back(std::filesystem::file_size(path));
    }
    if (is_finished) {
      EXPECT_TRUE(writer.finish());
      EXPECT_EQ(writer.messages(), written.size());
    }
    return written;
  }

  static std::vector<Heard> read(McapReader& reader) {
    std::vector<Heard> heard;
    McapMessage message;
    while (reader.next(message)) {
      heard.push_back({reader.channel(message.channel)->topic, message.sequence,
                       message.log_time_ns, std::string(message.bytes)});
    }
    return heard;
  }

  std::string folder;
  std::string path;
  std::vector<std::uint64_t> ends;  // of the file, behind each chunk
};

TEST_F(Mcap, WriterKnowsHowLongTheDiskTookAtMost) {
  McapWriter writer(later_each_time);
  EXPECT_EQ(writer.open(path, "test"), "");
  const auto first = writer.longest_write();
  EXPECT_TRUE(writer.write_metadata("a", {}));
  EXPECT_EQ(writer.longest_write(), first + std::chrono::seconds(1));
}

TEST_F(Mcap, WhatIsWrittenIsReadInOrder) {
  const auto written = write(3, 10);
  std::ifstream file(path, std::ios::binary);
  McapReader reader(file);
  ASSERT_EQ(reader.open(), "");
  EXPECT_EQ(read(reader), written);
  EXPECT_EQ(reader.problem(), "");
  EXPECT_EQ(reader.chunks(), 3u);
  EXPECT_EQ(reader.channel(1)->metadata.at("k"), "v");
  EXPECT_EQ(reader.schema(1)->bytes, "schema bytes");
  reader.rewind();
  EXPECT_EQ(read(reader), written);
  EXPECT_EQ(reader.messages(), written.size());
}

TEST_F(Mcap, AFileWithoutAMessageIsWhole) {
  write(0, 0);
  std::istringstream file(file_of(path));
  McapReader reader(file);
  ASSERT_EQ(reader.open(), "");
  EXPECT_TRUE(read(reader).empty());
  EXPECT_EQ(reader.problem(), "");
}

TEST_F(Mcap, AFileCutAtAnyByteIsReadUpToItsLastWholeChunk) {
  const auto written = write(3, 4);
  const std::string whole = file_of(path);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    SCOPED_TRACE("cut at " + std::to_string(size) + " of " + std::to_string(whole.size()));
    std::istringstream file(whole.substr(0, size));
    McapReader reader(file);
    if (size < kMcapMagic.size()) {
      EXPECT_NE(reader.open(), "");
      continue;
    }
    ASSERT_EQ(reader.open(), "");
    const auto heard = read(reader);
    // A chunk's indexes are behind it: it may be whole before the place where they end.
    const auto least = static_cast<std::size_t>(
        std::count_if(ends.begin(), ends.end(), [&](std::uint64_t end) { return end <= size; }));
    ASSERT_GE(heard.size(), 4 * least);
    ASSERT_EQ(heard.size() % 4, 0u);
    EXPECT_TRUE(std::equal(heard.begin(), heard.end(), written.begin()));
    EXPECT_TRUE(reader.is_cut());
    EXPECT_NE(reader.problem().find(std::to_string(heard.size()) + " record"), std::string::npos)
        << reader.problem();
  }
}

TEST_F(Mcap, AnyChangedByteIsEitherHarmlessOrToldAndCostsOneChunk) {
  const auto written = write(3, 4);
  const std::string whole = file_of(path);
  for (const int change : {0x01, 0x02, 0x40, 0x41, 0x80, 0xff}) {
    for (std::size_t at = kMcapMagic.size(); at < ends.back(); ++at) {
      SCOPED_TRACE("changed at " + std::to_string(at) + " by " + std::to_string(change));
      std::string bytes = whole;
      bytes[at] = static_cast<char>(bytes[at] ^ change);
      std::istringstream file(bytes);
      McapReader reader(file);
      ASSERT_EQ(reader.open(), "");
      const auto heard = read(reader);
      ASSERT_TRUE(heard == written || !reader.problem().empty());
      ASSERT_GE(heard.size(), written.size() - 4);
      ASSERT_FALSE(reader.is_cut()) << reader.problem();
      for (const Heard& each : heard) {
        ASSERT_NE(std::find(written.begin(), written.end(), each), written.end());
      }
    }
  }
}

TEST_F(Mcap, WithoutAnIndexADamagedHeadEndsTheFileAndIsTold) {
  const auto written = write(3, 4, false);
  std::string bytes = file_of(path);
  bytes[ends[0] + 5] = '\x41';  // of the length of the second chunk
  std::istringstream file(bytes);
  McapReader reader(file);
  ASSERT_EQ(reader.open(), "");
  EXPECT_EQ(read(reader).size(), 4u);
  EXPECT_NE(reader.problem().find("cut off"), std::string::npos) << reader.problem();
}

TEST_F(Mcap, ADamagedChunkCostsItsOwnMessagesAlsoWhenItIsTheFirst) {
  const auto written = write(3, 4);
  const std::string whole = file_of(path);
  int chunks_damaged = 0;
  for (std::size_t at = 0; at < ends.back(); ++at) {
    SCOPED_TRACE("changed at " + std::to_string(at));
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x41);
    std::istringstream file(bytes);
    McapReader reader(file);
    if (!reader.open().empty()) continue;
    const auto heard = read(reader);
    const std::string problem = reader.problem();
    if (!problem.ends_with("wrong CRC") && !problem.ends_with("cannot be unpacked")) continue;
    ++chunks_damaged;
    const std::size_t first = at < ends[0] ? 0 : at < ends[1] ? 4 : 8;
    auto expected = written;
    expected.erase(expected.begin() + static_cast<std::ptrdiff_t>(first),
                   expected.begin() + static_cast<std::ptrdiff_t>(first + 4));
    EXPECT_EQ(heard, expected);
    EXPECT_TRUE(problem.starts_with("1 damaged place left out")) << problem;
  }
  EXPECT_GT(chunks_damaged, 100);
}

TEST_F(Mcap, WhatFollowsTheEndOfARecordingIsTold) {
  const auto written = write(2, 3);
  const std::string whole = file_of(path);
  for (const std::string& tail : {whole, std::string("x"), std::string(3000, 'y')}) {
    std::istringstream file(whole + tail);
    McapReader reader(file);
    ASSERT_EQ(reader.open(), "");
    EXPECT_EQ(read(reader), written);
    EXPECT_FALSE(reader.is_cut());
    EXPECT_TRUE(reader.problem().starts_with(std::to_string(tail.size()) + " byte"));
    EXPECT_NE(reader.problem().find("after its end"), std::string::npos) << reader.problem();
  }
}

TEST_F(Mcap, RandomBytesBehindTheMagicNeverCrashTheReader) {
  const unsigned seed = 20261122;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  for (int run = 0; run < 2000; ++run) {
    std::string bytes(kMcapMagic);
    while (bytes.size() < 200) {
      bytes.push_back(static_cast<char>(random() % 16));  // numbers of records, short lengths
      bytes.push_back(static_cast<char>(random() % 40));
      bytes.append(random() % 9, '\0');
    }
    std::istringstream file(bytes);
    McapReader reader(file);
    ASSERT_EQ(reader.open(), "");
    read(reader);
    EXPECT_NE(reader.problem(), "");
  }
}

TEST_F(Mcap, AFileThatIsNotMcapIsToldSo) {
  std::istringstream text("this is a text file");
  EXPECT_NE(McapReader(text).open().find("not an MCAP file"), std::string::npos);
  std::istringstream empty;
  EXPECT_NE(McapReader(empty).open().find("too short"), std::string::npos);
  std::istringstream one("x");
  EXPECT_EQ(McapReader(one).open(), "it is too short to be a recording: 1 byte");
}

TEST_F(Mcap, AnExistingFileIsNotOverwrittenUnlessAsked) {
  write(1, 1);
  McapWriter writer;
  EXPECT_NE(writer.open(path, "test").find("File exists"), std::string::npos);
  EXPECT_EQ(writer.open(path, "test", true), "");
  McapWriter other;  // not while it is being written
  EXPECT_NE(other.open(path, "test", true).find("is being recorded"), std::string::npos);
}

TEST_F(Mcap, AFullDiskLosesOnlyTheChunkThatDidNotFitAndTheIndexIsWritten) {
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  McapWriter writer;
  ASSERT_EQ(writer.open(path, "test"), "");
  const std::uint16_t channel = writer.add_channel({0, "/a", "json", {}});
  ASSERT_TRUE(writer.write({channel, 1, 1, 1, "first"}));
  ASSERT_TRUE(writer.close_chunk());
  std::string noise(8000, '\0');
  std::mt19937 random(1);
  for (char& byte : noise) byte = static_cast<char>(random());
  const rlimit small{6000, before.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &small);
  ASSERT_TRUE(writer.write({channel, 2, 2, 2, noise}));
  EXPECT_FALSE(writer.close_chunk());
  EXPECT_FALSE(writer.write({channel, 3, 3, 3, "behind"}));
  EXPECT_FALSE(writer.finish());
  ::setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(writer.lost_messages(), 2u);
  EXPECT_NE(writer.problem().find("File too large"), std::string::npos) << writer.problem();
  std::ifstream file(path, std::ios::binary);
  McapReader reader(file);
  ASSERT_EQ(reader.open(), "");
  const auto heard = read(reader);
  ASSERT_EQ(heard.size(), 1u);
  EXPECT_EQ(heard[0].bytes, "first");
  EXPECT_EQ(reader.problem(), "");
}

TEST_F(Mcap, ALongRunOfMessagesIsClosedAsChunksByItself) {
  McapWriter writer;
  ASSERT_EQ(writer.open(path, "test"), "");
  const std::uint16_t channel = writer.add_channel({0, "/a", "json", {}});
  const std::string bytes(100000, 'x');
  for (std::uint32_t i = 0; i < 30; ++i) ASSERT_TRUE(writer.write({channel, i, i, i, bytes}));
  EXPECT_GE(writer.messages(), 20u);
  EXPECT_LT(writer.open_messages(), 11u);
}

/// A record as it stands in a file.
std::string record(McapOp op, const std::string& content) {
  std::string bytes(1, static_cast<char>(op));
  for (int shift = 0; shift < 64; shift += 8) {
    bytes.push_back(static_cast<char>(std::uint64_t{content.size()} >> shift));
  }
  return bytes + content;
}

std::string little(std::uint32_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text.push_back(static_cast<char>(std::uint64_t{value} >> 8 * i));
  return text;
}

std::string counted_text(const std::string& text) {
  return little(static_cast<std::uint32_t>(text.size()), 4) + text;
}

TEST(HostileMcap, SchemasDoNotFillTheMemory) {
  constexpr std::uint32_t kSchemas = 40;
  std::string bytes(kMcapMagic);
  const std::string large(std::size_t{1} << 20, 'x');
  for (std::uint32_t id = 1; id <= kSchemas; ++id) {
    bytes += record(McapOp::kSchema,
                    little(id, 2) + counted_text("s") + counted_text("") + counted_text(large));
  }
  std::istringstream in(bytes);
  McapReader reader(in);
  ASSERT_EQ(reader.open(), "");
  McapMessage message;
  for (int round = 0; round < 2; ++round) {  // what is played again needs no more
    EXPECT_FALSE(reader.next(message));
    std::uint64_t kept = 0;
    for (std::uint32_t id = 1; id <= kSchemas; ++id) {
      const McapSchema* const schema = reader.schema(static_cast<std::uint16_t>(id));
      kept += schema != nullptr ? schema->bytes.size() : 0;
    }
    EXPECT_LE(kept, McapReader::kMaxKeptBytes);
    EXPECT_GE(kept, McapReader::kMaxKeptBytes / 2);
    EXPECT_GT(reader.damaged_chunks(), 0U);
    reader.rewind();
  }
}

TEST(HostileMcap, KeysOfAChannelDoNotFillTheMemory) {
  std::string keys;
  for (std::uint32_t i = 0; i < 400'000; ++i) keys += counted_text(little(i, 4)) + counted_text("");
  std::string bytes(kMcapMagic);
  bytes += record(McapOp::kChannel, little(1, 2) + little(0, 2) + counted_text("/t") +
                                        counted_text("json") + counted_text(keys));
  std::istringstream in(bytes);
  McapReader reader(in);
  ASSERT_EQ(reader.open(), "");
  McapMessage message;
  EXPECT_FALSE(reader.next(message));
  EXPECT_EQ(reader.channel(1), nullptr);
  EXPECT_EQ(reader.damaged_chunks(), 1U);
}

TEST(HostileMcap, TextOfTheFileIsToldInPlainCharacters) {
  std::string bytes(kMcapMagic);
  bytes += record(McapOp::kChunk, little(0, 8) + little(0, 8) + little(0, 8) + little(0, 4) +
                                      counted_text("\x1b[2J\xff\xc2\x9b") + little(0, 8));
  std::istringstream in(bytes);
  McapReader reader(in);
  ASSERT_EQ(reader.open(), "");
  McapMessage message;
  EXPECT_FALSE(reader.next(message));
  const std::string problem = reader.problem();
  EXPECT_NE(problem.find("compressed with"), std::string::npos) << problem;
  EXPECT_TRUE(std::all_of(problem.begin(), problem.end(), [](char c) {
    return c >= ' ' && c < 0x7F;
  })) << problem;
}

}  // namespace
}  // namespace swarmtalk::recording
