// Reports: what a daemon tells of its robot when somebody looks, and the question that starts it,
// as bytes of messages on the channel "harvest" (docs/wire-format.md, Reports). A leaf: no I/O, no
// clock. Anything may come in: what cannot be read is refused as a whole.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace swarmtalk::report {

inline constexpr std::uint8_t kVersion = 1;
inline constexpr std::size_t kMostRoots = 4;
inline constexpr std::size_t kMostWanted = 4;
inline constexpr std::size_t kMostBodyBytes = 250;  // of one record
inline constexpr std::size_t kMostReportBytes = 1200;
inline constexpr std::size_t kMostNameBytes = 20;  // of a robot's name
inline constexpr std::size_t kMostKeyBytes = 20;   // of a value that a program has set
inline constexpr std::size_t kMostValueBytes = 40;
inline constexpr std::uint32_t kAgeStepMs = 250;
inline constexpr std::uint32_t kAirStepUs = 10;

/// "Somebody looks here": from a viewer to its own daemon.
struct Look {
  std::uint8_t seconds = 0;           // for so long
  std::vector<std::uint16_t> wanted;  // robots whose details are wanted, at most kMostWanted
  bool operator==(const Look&) const = default;
};

/// One who looks, as a transmitter knows it.
struct Root {
  std::uint16_t node = 0;
  std::uint16_t number = 0;  // counts the root's own reports: newer ones replace older ones
  std::uint8_t depth = 0;    // hops from the transmitter to the root; 0: it is the root
  std::uint16_t parent = 0;  // to whom the transmitter gives what it has gathered for this root
  std::uint8_t seconds = 0;  // for how long the root still looks
  bool operator==(const Root&) const = default;
};

/// What one robot says of itself, not taken apart: forwarders need not know what is in it.
struct Record {
  std::uint16_t node = 0;
  std::uint8_t age_steps = 0;  // of kAgeStepMs, since the robot said it; 255: that or more
  std::string body;            // at most kMostBodyBytes
  bool operator==(const Record&) const = default;
};

struct Report {
  std::uint16_t round_air_steps = 0;  // of kAirStepUs: all reports that the transmitter hears, once
  std::vector<std::uint16_t> wanted;
  std::vector<Root> roots;
  std::vector<Record> records;
  bool operator==(const Report&) const = default;
};

struct Place {
  std::int16_t x_mm = 0, y_mm = 0;
  std::uint16_t theta_turns16 = 0;
  std::uint8_t age_10ms = 0;  // 254: 2540 ms or more
  bool operator==(const Place&) const = default;
};

struct Hearing {
  std::uint16_t node = 0;
  std::uint8_t loss_255 = 0;  // share of its frames that did not come, in 1/255
  bool operator==(const Hearing&) const = default;
};

struct ChannelUse {
  std::uint16_t number = 0;
  std::uint8_t publishers = 0, subscribers = 0;
  std::uint16_t received_per_10s = 0;
  bool operator==(const ChannelUse&) const = default;
};

struct Losses {
  std::uint32_t air = 0, kernel = 0, daemon = 0, late = 0;
  bool operator==(const Losses&) const = default;
};

/// What a program of the robot has set for whoever asks.
struct Value {
  std::string key;   // 1 to kMostKeyBytes
  std::string text;  // at most kMostValueBytes
  bool operator==(const Value&) const = default;
};

/// A record's body, taken apart. Absent: the robot does not know, or did not say it this time.
struct Facts {
  std::optional<Place> place;
  std::vector<Hearing> hears;
  std::vector<ChannelUse> channels;
  std::optional<Losses> lost;
  std::optional<std::vector<std::string>> programs;
  std::optional<std::string> name;
  std::vector<Value> values;
  bool operator==(const Facts&) const = default;
};

std::string encode(const Look& look);
std::string encode(const Report& report);
/// Leaves out what does not fit into kMostBodyBytes, whole sections first to last: place, losses,
/// name, neighbours, channels; then as many values and as many programs as there is room for.
std::string encode_body(const Facts& facts);

/// Bytes that a record takes in a report.
inline std::size_t size_of(const Record& record) {
  return 4 + record.body.size();
}

bool is_look(std::string_view bytes);
bool is_report(std::string_view bytes);
/// @return none: it is none, of another version, or damaged
std::optional<Look> decode_look(std::string_view bytes);
std::optional<Report> decode_report(std::string_view bytes);
/// Sections of a kind that is not known are skipped. @return none: damaged
std::optional<Facts> decode_body(std::string_view body);

}  // namespace swarmtalk::report
