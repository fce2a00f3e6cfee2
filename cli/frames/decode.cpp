#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "cli/common/commands.hpp"
#include "cli/common/looking.hpp"
#include "cli/frames/air_frames.hpp"
#include "cli/frames/capture_files.hpp"
#include "cli/text/format.hpp"
#include "cli/text/hex.hpp"
#include "text/encoding.hpp"
#include "text/utf8.hpp"

namespace swarmtalk::cli {
namespace {

constexpr std::size_t kMaxInputBytes = 16 * 1024 * 1024;

Json packet_json(const AirPacket& packet) {
  const std::string_view payload(reinterpret_cast<const char*>(packet.payload.data()),
                                 packet.payload.size());
  Json json{{"node", packet.node},
            {"message", packet.message},
            {"sequence", packet.sequence},
            {"last", packet.is_last},
            {"channel", packet.channel},
            {"ttl", packet.ttl},
            {"hops", nullptr},
            {"message_bytes", nullptr},
            {"epoch", nullptr},
            {"timestamped", packet.is_timestamped},
            {"crossed_gateway", packet.crossed_gateway},
            {"bytes", packet.size_bytes},
            {"text", nullptr},
            {"hex", to_hex(payload)}};
  if (packet.hops) json["hops"] = *packet.hops;
  if (packet.message_size) json["message_bytes"] = *packet.message_size;
  if (packet.epoch) json["epoch"] = *packet.epoch;
  if (text::is_utf8(payload)) json["text"] = payload;
  return json;
}

/// @return null: it cannot be read; `problem` says why, and also what is wrong with one that can
Json frame_json(std::string_view bytes, std::string& problem) {
  std::size_t ethernet = 0;
  frame::Frame frame;
  auto result = frame::parse(bytes_of(bytes), frame);
  if (result == frame::ParseResult::kNotOurs && bytes.size() > kEthernetHeaderBytes) {
    const auto behind = frame::parse(bytes_of(bytes.substr(kEthernetHeaderBytes)), frame);
    if (behind != frame::ParseResult::kNotOurs) {
      result = behind;
      ethernet = kEthernetHeaderBytes;
    }
  }
  const bool is_sealed = result == frame::ParseResult::kSealed;
  if (result != frame::ParseResult::kOk && !is_sealed) {
    problem = result == frame::ParseResult::kNotOurs
                  ? "it does not begin as an air frame does, with or without an Ethernet header"
                  : "it is not whole: swarmtalkd counts it under " +
                        std::string(frame::counter_name(result));
    return nullptr;
  }
  Json json{{"profile", profile_name(frame.header.profile)},
            {"node", frame.header.node},
            {"epoch", frame.header.epoch},
            {"counter", frame.header.counter},
            {"bytes", bytes.size() - ethernet},
            {"sealed", is_sealed},
            {"beacon", frame.header.is_beacon},
            {"pose", nullptr},
            {"packets", Json::array()},
            {"last_messages", Json::array()}};
  if (frame.header.pose && !frame.header.pose->is_stale()) {
    const frame::FramePose& pose = *frame.header.pose;
    json["pose"] = {{"x_m", cli::number(static_cast<float>(pose.x_m()))},
                    {"y_m", cli::number(static_cast<float>(pose.y_m()))},
                    {"theta_rad", cli::number(static_cast<float>(pose.theta_rad()))},
                    {"age_ms", pose.age_10ms * 10}};
  }
  frame::PacketReader packets(frame.packets);
  std::span<const std::uint8_t> each;
  while (packets.next(each)) {
    const auto packet = decode_packet(frame.header.profile, each);
    json["packets"].push_back(
        packet ? packet_json(*packet)
               : Json{{"bytes", each.size()},
                      {"problem", "shorter than a header, or an unknown profile"}});
  }
  if (packets.is_malformed()) problem = "a packet's length reaches beyond the frame";
  json["problem"] = problem.empty() ? Json() : Json(problem);
  frame::LastMessageReader beacons(frame.last_messages);
  frame::LastMessage last;
  while (beacons.next(last)) {
    json["last_messages"].push_back({{"channel", last.channel}, {"message", last.number}});
  }
  return json;
}

/// A field a line, those of packets further in.
void lines_of(const Json& json, const std::string& indent, std::string& text) {
  for (const auto& [key, value] : json.items()) {
    if (value.is_array()) {
      std::size_t i = 0;
      for (const Json& each : value) {
        text += indent + key + " " + std::to_string(++i) + "\n";
        lines_of(each, indent + "  ", text);
      }
    } else if (value.is_object()) {
      text += indent + key + "\n";
      lines_of(value, indent + "  ", text);
    } else if (value.is_string()) {
      const std::string word = value.get<std::string>();
      text += indent + key + " " + (key == "text" ? payload_text(word) : word) + "\n";
    } else {
      text += indent + key + " " +
              (value.is_null()      ? "unknown"
               : value.is_boolean() ? (value.get<bool>() ? "yes" : "no")
                                    : value.dump()) +
              "\n";
    }
  }
}

frame::ProfileId profile_of(const std::string& name) {
  for (const auto profile : {frame::ProfileId::kWifi, frame::ProfileId::kKilobot,
                             frame::ProfileId::kClassic2020, frame::ProfileId::kFootbot}) {
    if (profile_name(profile) == name) return profile;
  }
  return frame::ProfileId::kWifi;
}

/// @param where  goes before what is wrong: "line 3: ", or nothing
int decode_one(const Common& common, const std::string& profile, const std::string& word,
               const std::string& where) {
  if (const std::string why = text::bare_return_problem(word); !why.empty()) {
    return fail(where + "it " + why, kExitUsage);
  }
  const auto bytes = from_hex(word);
  if (!bytes) {
    const std::string begin = word.substr(0, 20) + (word.size() > 20 ? "..." : "");
    return fail(where + "'" + begin + "' is not hexadecimal: pairs of digits, as in 53:54:01",
                kExitUsage);
  }
  std::string problem;
  Json json;
  if (profile.empty()) {
    json = frame_json(*bytes, problem);
  } else if (const auto packet = decode_packet(profile_of(profile), bytes_of(*bytes))) {
    json = packet_json(*packet);
  } else {
    problem = "it is shorter than the header of a packet of profile " + profile;
  }
  if (json.is_null() && common.is_json) json = {{"bytes", bytes->size()}, {"problem", problem}};
  if (!json.is_null()) {
    std::string text;
    if (common.is_json) {
      text = json_text(json) + "\n";
    } else {
      json.erase("problem");  // told as an error
      lines_of(json, "", text);
    }
    if (const int printed = print(text); printed != kExitOk) return printed;
  }
  return problem.empty() ? kExitOk
                         : fail(where + "a frame of " + std::to_string(bytes->size()) +
                                (bytes->size() == 1 ? " byte: " : " bytes: ") + problem);
}

}  // namespace

int decode(const Common& common, const DecodeArguments& arguments) {
  int exit_code = kExitOk;
  const auto take = [&](const std::string& word, const std::string& where) {
    const int one = decode_one(common, arguments.profile, word, where);
    if (one != kExitOk) exit_code = one;
  };
  for (const std::string& word : arguments.frames) {
    if (word != "-") {
      take(word, "");
      continue;
    }
    std::string line;
    char buffer[4096];
    ssize_t count = 0;
    std::size_t number = 0;
    bool has_frame = false;
    const auto take_line = [&](std::string_view read) {
      if (++number == 1) read = text::without_mark(read);
      if (read.find_first_not_of(" \t\r") == std::string_view::npos) return;
      has_frame = true;
      take(std::string(text::without_return(read)), "line " + std::to_string(number) + ": ");
    };
    while ((count = ::read(STDIN_FILENO, buffer, sizeof buffer)) > 0) {
      line.append(buffer, static_cast<std::size_t>(count));
      const std::string problem = number == 0 ? text::encoding_problem(line) : "";
      if (!problem.empty()) return fail("standard input " + problem, kExitUsage);
      for (auto end = line.find('\n'); end != std::string::npos; end = line.find('\n')) {
        take_line(std::string_view(line).substr(0, end));
        line.erase(0, end + 1);
      }
      if (line.size() > kMaxInputBytes) {
        return fail("line " + std::to_string(number + 1) + " is longer than any frame");
      }
    }
    if (count < 0) return fail(std::string("cannot read standard input: ") + std::strerror(errno));
    if (!line.empty()) take_line(line);
    if (!has_frame) exit_code = fail("there was no frame on standard input");
  }
  return exit_code;
}

}  // namespace swarmtalk::cli
