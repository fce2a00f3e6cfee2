// swarmtalk-suite-recording: LOG FILE. Makes a recording of a run's log; swarmtalk-suite calls it.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "suite/recording/run_recording.hpp"
#include "suite/sim/program_main.hpp"

namespace swarmtalk::suite {
namespace {

int record(const std::string& log, const std::string& path) {
  std::ifstream lines(log);
  std::string line;
  if (!lines || !std::getline(lines, line)) throw std::runtime_error("cannot read " + log);
  const std::string part = path + ".part";  // the name is there when the recording is whole
  std::uint64_t number = 1;
  try {
    RunRecording recording(part);
    recording.begin(nlohmann::json::parse(line));
    while (stopped == 0 && std::getline(lines, line)) {
      ++number;
      if (!lines.eof()) recording.add(nlohmann::json::parse(line));  // else it was cut off
    }
    recording.finish();
  } catch (const nlohmann::json::exception&) {
    std::filesystem::remove(part);
    throw std::runtime_error(log + " is not a log of a run: see line " + std::to_string(number));
  } catch (const std::out_of_range&) {
    std::filesystem::remove(part);
    throw std::runtime_error(log + " names a robot that it does not have in line " +
                             std::to_string(number));
  }
  if (stopped != 0) {
    std::filesystem::remove(part);
    return 128 + SIGINT;
  }
  std::filesystem::rename(part, path);
  return 0;
}

}  // namespace
}  // namespace swarmtalk::suite

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: swarmtalk-suite-recording LOG FILE; see swarmtalk-suite --help\n");
    return 2;
  }
  return swarmtalk::suite::program_main(
      "swarmtalk-suite-recording", [argv] { return swarmtalk::suite::record(argv[1], argv[2]); });
}
