#include "cli/text/message_text.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <numbers>

#include "cli/text/format.hpp"
#include "cli/text/hex.hpp"
#include "text/plain.hpp"

namespace swarmtalk::cli {
namespace {

constexpr std::string_view kLetters = "csntpxvldbhIUj%";

std::chrono::microseconds wall(std::chrono::steady_clock::time_point time) {
  using std::chrono::duration_cast;
  using std::chrono::microseconds;
  const auto age = std::chrono::steady_clock::now() - time;
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return duration_cast<microseconds>(now) - duration_cast<microseconds>(age);
}

std::string fixed(double value, const char* pattern) {
  if (!std::isfinite(value)) return "nan";
  char text[64];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}

std::chrono::steady_clock::time_point time_of(const Message& message) {
  return message.received_at.value_or(std::chrono::steady_clock::now());
}

}  // namespace

std::string iso_time(std::chrono::steady_clock::time_point time) {
  const auto us = wall(time).count();
  const auto seconds = static_cast<std::time_t>(us / 1'000'000);
  std::tm utc{};
  ::gmtime_r(&seconds, &utc);
  char date[32];
  std::strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%S", &utc);
  char text[48];
  std::snprintf(text, sizeof text, "%s.%06dZ", date, static_cast<int>(us % 1'000'000));
  return text;
}

std::string unix_time(std::chrono::steady_clock::time_point time) {
  const auto us = wall(time).count();
  char text[48];
  std::snprintf(text, sizeof text, "%lld.%06d", static_cast<long long>(us / 1'000'000),
                static_cast<int>(us % 1'000'000));
  return text;
}

const char* MessageText::help() {
  return "a format: %c channel, %s sender, %n message number, %t transmitter, the robot that it "
         "was heard from, %p payload, %x payload in hexadecimal, %v values of --fmt, %l bytes, %d "
         "distance in metres, %b bearing in degrees, "
         "%h hops, %I time, %U seconds since 1970, %j JSON, %%; \\n, \\t and \\0 too";
}

std::optional<MessageText> MessageText::make(const LookArguments& arguments, std::string& problem) {
  MessageText text;
  text.arguments_ = arguments;
  if (!arguments.struct_format.empty()) {
    text.format_ = StructFormat::parse(arguments.struct_format, problem);
    if (!text.format_) {
      problem = "--fmt " + arguments.struct_format + " is not a format: " + problem;
      return std::nullopt;
    }
  }
  const std::string& pattern = arguments.pattern;
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    if (pattern[i] == '\\') {
      const std::string letter = pattern.substr(++i, 1);
      if (letter.empty() || std::string_view("nt0\\%").find(letter) == std::string_view::npos) {
        problem = "-F has \\" + letter + "; it takes \\n, \\t, \\0 and \\\\";
        return std::nullopt;
      }
      continue;
    }
    if (pattern[i] != '%') continue;
    const std::string letter = pattern.substr(++i, 1);
    if (letter.empty() || kLetters.find(letter) == std::string_view::npos) {
      problem = "-F has %" + letter + "; it takes %c %s %n %t %p %x %v %l %d %b %h %I %U %j and %%";
      return std::nullopt;
    }
    if (letter == "v" && !text.format_) {
      problem = "%v in -F needs --fmt, which says what the values are";
      return std::nullopt;
    }
  }
  return text;
}

std::string MessageText::values(const Message& message) const {
  const auto values = format_->unpack(message.payload);
  if (!values) {
    return "(not " + format_->text() + ": " + std::to_string(message.payload.size()) +
           " bytes, not " + std::to_string(format_->size_bytes()) + ")";
  }
  std::string text;
  for (const auto& value : *values) text += (text.empty() ? "" : " ") + to_text(value);
  return text;
}

std::string MessageText::by_pattern(const std::string& channel, const Message& message) const {
  const std::string& pattern = arguments_.pattern;
  std::string line;
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    if (pattern[i] == '\\' && i + 1 < pattern.size()) {
      const char letter = pattern[++i];
      line += letter == 'n' ? '\n' : letter == 't' ? '\t' : letter == '0' ? '\0' : letter;
      continue;
    }
    if (pattern[i] != '%') {
      line += pattern[i];
      continue;
    }
    switch (pattern[++i]) {
      case 'c':
        line += text::plain(channel);
        break;
      case 's':
        line += std::to_string(message.sender);
        break;
      case 'n':
        line += std::to_string(message.message_number);
        break;
      case 't':
        line += std::to_string(message.transmitter);
        break;
      case 'p':
        line += text::plain(message.payload);
        break;
      case 'x':
        line += to_hex(message.payload);
        break;
      case 'v':
        line += text::plain(values(message));
        break;
      case 'l':
        line += std::to_string(message.payload.size());
        break;
      case 'd':
        line += fixed(static_cast<double>(message.distance_m), "%.3f");
        break;
      case 'b':
        line += fixed(static_cast<double>(message.bearing_rad) * 180 / std::numbers::pi, "%.1f");
        break;
      case 'h':
        line += message.hops == Message::kHopsUnknown ? "nan" : std::to_string(message.hops);
        break;
      case 'I':
        line += iso_time(time_of(message));
        break;
      case 'U':
        line += unix_time(time_of(message));
        break;
      case 'j':
        line += text::plain(to_json(channel, message).dump());
        break;
      default:
        line += '%';
    }
  }
  return line;
}

std::optional<std::string> MessageText::line(const std::string& channel, const Message& message,
                                             bool is_json) const {
  if (!arguments_.pattern.empty()) return by_pattern(channel, message);
  if (!format_ && !arguments_.has_time) return std::nullopt;
  if (is_json) {
    Json json = to_json(channel, message);
    if (arguments_.has_time) json["time"] = iso_time(time_of(message));
    if (format_) {
      json["values"] = nullptr;
      if (const auto values = format_->unpack(message.payload)) {
        json["values"] = Json::array();
        for (const auto& value : *values) {
          std::visit([&json](const auto& plain) { json["values"].push_back(plain); }, value);
        }
      }
    }
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
  }
  std::string line = arguments_.has_time ? iso_time(time_of(message)) + "  " : "";
  line += to_line(channel, message);
  if (format_) line += "  values " + values(message);
  return line;
}

}  // namespace swarmtalk::cli
