#include "report/report.hpp"

#include <algorithm>

namespace swarmtalk::report {
namespace {

constexpr char kLook = 'L';
constexpr char kReport = 'R';

enum Section : std::uint8_t {
  kPlace = 1,
  kHears = 2,
  kChannels = 3,
  kLost = 4,
  kPrograms = 5,
  kName = 6,
  kValues = 7
};

constexpr std::size_t kPlaceBytes = 7;
constexpr std::size_t kHearingBytes = 3;
constexpr std::size_t kChannelBytes = 6;
constexpr std::size_t kLossBytes = 16;

class Writer {
 public:
  void put8(std::uint8_t value) { bytes.push_back(static_cast<char>(value)); }
  void put16(std::uint16_t value) {
    put8(static_cast<std::uint8_t>(value >> 8));
    put8(static_cast<std::uint8_t>(value & 0xFF));
  }
  void put32(std::uint32_t value) {
    put16(static_cast<std::uint16_t>(value >> 16));
    put16(static_cast<std::uint16_t>(value & 0xFFFF));
  }

  std::string bytes;
};

/// Reads past the end give 0 and are remembered.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}

  std::uint8_t get8() {
    if (rest_.empty()) {
      is_cut_ = true;
      return 0;
    }
    const auto value = static_cast<std::uint8_t>(rest_.front());
    rest_.remove_prefix(1);
    return value;
  }
  std::uint16_t get16() {
    const std::uint16_t high = get8();
    return static_cast<std::uint16_t>(high << 8 | get8());
  }
  std::uint32_t get32() {
    const std::uint32_t high = get16();
    return high << 16 | get16();
  }
  std::string_view take(std::size_t size) {
    if (size > rest_.size()) {
      is_cut_ = true;
      size = rest_.size();
    }
    const std::string_view taken = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return taken;
  }

  bool is_empty() const { return rest_.empty(); }
  bool is_cut() const { return is_cut_; }

 private:
  std::string_view rest_;
  bool is_cut_ = false;
};

/// A section, if there is still room for it in the body.
void add_section(std::string& body, Section kind, const std::string& content) {
  if (body.size() + 2 + content.size() > kMostBodyBytes) return;
  body.push_back(static_cast<char>(kind));
  body.push_back(static_cast<char>(content.size()));
  body += content;
}

/// What a section of texts may still hold.
std::size_t room_in(const std::string& body) {
  constexpr std::size_t kHeader = 2;
  return body.size() + kHeader < kMostBodyBytes ? kMostBodyBytes - body.size() - kHeader : 0;
}

bool read_section(std::uint8_t kind, std::string_view content, Facts& facts) {
  Reader reader(content);
  switch (kind) {
    case kPlace: {
      Place place;
      place.x_mm = static_cast<std::int16_t>(reader.get16());
      place.y_mm = static_cast<std::int16_t>(reader.get16());
      place.theta_turns16 = reader.get16();
      place.age_10ms = reader.get8();
      facts.place = place;
      return content.size() == kPlaceBytes;
    }
    case kHears:
      while (!reader.is_empty()) {
        const std::uint16_t node = reader.get16();
        facts.hears.push_back({node, reader.get8()});
      }
      return content.size() % kHearingBytes == 0;
    case kChannels:
      while (!reader.is_empty()) {
        ChannelUse use;
        use.number = reader.get16();
        use.publishers = reader.get8();
        use.subscribers = reader.get8();
        use.received_per_10s = reader.get16();
        facts.channels.push_back(use);
      }
      return content.size() % kChannelBytes == 0;
    case kLost: {
      Losses lost;
      lost.air = reader.get32();
      lost.kernel = reader.get32();
      lost.daemon = reader.get32();
      lost.late = reader.get32();
      facts.lost = lost;
      return content.size() == kLossBytes;
    }
    case kPrograms:
      if (!facts.programs) facts.programs.emplace();
      while (!reader.is_empty()) {
        const std::size_t size = reader.get8();
        facts.programs->emplace_back(reader.take(size));
      }
      return !reader.is_cut();
    case kName:
      facts.name = std::string(content);
      return content.size() <= kMostNameBytes;
    case kValues:
      while (!reader.is_empty()) {
        Value value;
        const std::size_t key_bytes = reader.get8();
        value.key = reader.take(key_bytes);
        const std::size_t text_bytes = reader.get8();
        value.text = reader.take(text_bytes);
        if (value.key.empty() || key_bytes > kMostKeyBytes || text_bytes > kMostValueBytes)
          return false;
        facts.values.push_back(std::move(value));
      }
      return !reader.is_cut();
    default:
      return true;
  }
}

std::optional<std::vector<std::uint16_t>> read_wanted(Reader& reader) {
  const std::size_t count = reader.get8();
  if (count > kMostWanted) return std::nullopt;
  std::vector<std::uint16_t> wanted;
  for (std::size_t i = 0; i < count; ++i) wanted.push_back(reader.get16());
  return wanted;
}

void write_wanted(Writer& writer, const std::vector<std::uint16_t>& wanted) {
  const std::size_t count = std::min(wanted.size(), kMostWanted);
  writer.put8(static_cast<std::uint8_t>(count));
  for (std::size_t i = 0; i < count; ++i) writer.put16(wanted[i]);
}

void add_values(std::string& body, const std::vector<Value>& values) {
  Writer section;
  for (const Value& each : values) {
    if (section.bytes.size() + 2 + each.key.size() + each.text.size() > room_in(body)) continue;
    section.put8(static_cast<std::uint8_t>(each.key.size()));
    section.bytes += each.key;
    section.put8(static_cast<std::uint8_t>(each.text.size()));
    section.bytes += each.text;
  }
  if (!section.bytes.empty()) add_section(body, kValues, section.bytes);
}

void add_programs(std::string& body, const std::vector<std::string>& programs) {
  Writer section;
  for (const std::string& name : programs) {
    const std::size_t size = std::min<std::size_t>(name.size(), 255);
    if (section.bytes.size() + 1 + size > room_in(body)) continue;
    section.put8(static_cast<std::uint8_t>(size));
    section.bytes += name.substr(0, size);
  }
  add_section(body, kPrograms, section.bytes);
}

bool begins_with(std::string_view bytes, char kind) {
  return !bytes.empty() && bytes.front() == kind;
}

}  // namespace

std::string encode(const Look& look) {
  Writer writer;
  writer.put8(static_cast<std::uint8_t>(kLook));
  writer.put8(kVersion);
  writer.put8(look.seconds);
  write_wanted(writer, look.wanted);
  return writer.bytes;
}

std::string encode(const Report& report) {
  Writer writer;
  writer.put8(static_cast<std::uint8_t>(kReport));
  writer.put8(kVersion);
  writer.put16(report.round_air_steps);
  write_wanted(writer, report.wanted);
  const std::size_t roots = std::min(report.roots.size(), kMostRoots);
  writer.put8(static_cast<std::uint8_t>(roots));
  for (std::size_t i = 0; i < roots; ++i) {
    const Root& root = report.roots[i];
    writer.put16(root.node);
    writer.put16(root.number);
    writer.put8(root.depth);
    writer.put16(root.parent);
    writer.put8(root.seconds);
  }
  for (const Record& record : report.records) {
    writer.put16(record.node);
    writer.put8(record.age_steps);
    writer.put8(static_cast<std::uint8_t>(record.body.size()));
    writer.bytes += record.body;
  }
  return writer.bytes;
}

std::string encode_body(const Facts& facts) {
  std::string body;
  if (facts.place) {
    Writer writer;
    writer.put16(static_cast<std::uint16_t>(facts.place->x_mm));
    writer.put16(static_cast<std::uint16_t>(facts.place->y_mm));
    writer.put16(facts.place->theta_turns16);
    writer.put8(facts.place->age_10ms);
    add_section(body, kPlace, writer.bytes);
  }
  if (facts.lost) {
    Writer writer;
    writer.put32(facts.lost->air);
    writer.put32(facts.lost->kernel);
    writer.put32(facts.lost->daemon);
    writer.put32(facts.lost->late);
    add_section(body, kLost, writer.bytes);
  }
  Writer hears, channels;
  for (const Hearing& each : facts.hears) {
    hears.put16(each.node);
    hears.put8(each.loss_255);
  }
  for (const ChannelUse& each : facts.channels) {
    channels.put16(each.number);
    channels.put8(each.publishers);
    channels.put8(each.subscribers);
    channels.put16(each.received_per_10s);
  }
  if (facts.name) add_section(body, kName, facts.name->substr(0, kMostNameBytes));
  if (!facts.hears.empty()) add_section(body, kHears, hears.bytes);
  if (!facts.channels.empty()) add_section(body, kChannels, channels.bytes);
  add_values(body, facts.values);
  if (facts.programs) add_programs(body, *facts.programs);
  return body;
}

bool is_look(std::string_view bytes) {
  return begins_with(bytes, kLook);
}

bool is_report(std::string_view bytes) {
  return begins_with(bytes, kReport);
}

std::optional<Look> decode_look(std::string_view bytes) {
  Reader reader(bytes);
  if (reader.get8() != static_cast<std::uint8_t>(kLook) || reader.get8() != kVersion) return {};
  Look look;
  look.seconds = reader.get8();
  const auto wanted = read_wanted(reader);
  if (!wanted || reader.is_cut() || !reader.is_empty()) return {};
  look.wanted = *wanted;
  return look;
}

std::optional<Report> decode_report(std::string_view bytes) {
  Reader reader(bytes);
  if (reader.get8() != static_cast<std::uint8_t>(kReport) || reader.get8() != kVersion) return {};
  Report report;
  report.round_air_steps = reader.get16();
  const auto wanted = read_wanted(reader);
  if (!wanted) return {};
  report.wanted = *wanted;
  const std::size_t roots = reader.get8();
  if (roots > kMostRoots) return {};
  for (std::size_t i = 0; i < roots; ++i) {
    Root root;
    root.node = reader.get16();
    root.number = reader.get16();
    root.depth = reader.get8();
    root.parent = reader.get16();
    root.seconds = reader.get8();
    report.roots.push_back(root);
  }
  while (!reader.is_empty()) {
    Record record;
    record.node = reader.get16();
    record.age_steps = reader.get8();
    const std::size_t size = reader.get8();
    if (size > kMostBodyBytes) return {};
    record.body = reader.take(size);
    report.records.push_back(std::move(record));
  }
  if (reader.is_cut()) return {};
  return report;
}

std::optional<Facts> decode_body(std::string_view body) {
  Reader reader(body);
  Facts facts;
  while (!reader.is_empty()) {
    const std::uint8_t kind = reader.get8();
    const std::size_t size = reader.get8();
    const std::string_view content = reader.take(size);
    if (reader.is_cut() || !read_section(kind, content, facts)) return {};
  }
  return facts;
}

}  // namespace swarmtalk::report
