// EventLog: the emulator's record, one JSON object per line, in the order in which the emulation
// comes to them (times of different nodes may be out of order by less than one quantum). Nothing in
// it depends on the machine or the time of day: the same scenario and seed give the same bytes.
#pragma once

#include <cstdint>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <ostream>
#include <stdexcept>
#include <string>
#include <string_view>

namespace swarmtalk::emulator {

class EventLog {
 public:
  using Fields = nlohmann::ordered_json;

  /// @param path  file to write; "" for none, "-" for standard output
  explicit EventLog(const std::string& path) {
    if (path == "-") stream_ = &std::cout;
    if (path.empty() || path == "-") return;
    file_ = std::make_unique<std::ofstream>(path);
    if (!*file_) throw std::runtime_error(path + ": cannot be written");
  }

  /// Makes a log that writes to `stream` (tests).
  explicit EventLog(std::ostream& stream) : stream_(&stream) {}

  void use(std::ostream& stream) { stream_ = &stream; }
  bool is_on() const { return stream_ != nullptr || file_ != nullptr; }

  /// @param fields  an object; its members follow time, node and event in their order
  void write(std::uint64_t time_ns, std::string_view node, std::string_view event,
             const Fields& fields = Fields::object()) {
    if (!is_on()) return;
    Fields line{{"time_us", time_ns / 1000}, {"node", node}, {"event", event}};
    line.update(fields);
    (file_ != nullptr ? *file_ : *stream_)
        << line.dump(-1, ' ', false, Fields::error_handler_t::replace) << '\n';
  }

  void flush() {
    if (is_on()) (file_ != nullptr ? *file_ : *stream_).flush();
  }

 private:
  std::unique_ptr<std::ofstream> file_;
  std::ostream* stream_ = nullptr;
};

}  // namespace swarmtalk::emulator
