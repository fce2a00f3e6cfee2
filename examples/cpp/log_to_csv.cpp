// Writes every message of some channels to a CSV file. Usage: log_to_csv FILE CHANNEL...
//
// Times are seconds since 1970, so that the files of several robots can be put side by side. An
// empty cell is unknown.
#include <chrono>
#include <csignal>
#include <cstdio>
#include <iostream>
#include <string>
#include <swarmtalk/client.hpp>
#include <vector>

namespace {

swarmtalk::Client* running = nullptr;

void on_signal(int) {
  running->stop();
}

std::string number(float value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f", static_cast<double>(value));
  return value == value ? text : "";  // NaN: unknown
}

double seconds_since_1970(const swarmtalk::Message& message) {
  auto when = std::chrono::system_clock::now();
  if (message.received_at) {
    const auto age = std::chrono::steady_clock::now() - *message.received_at;
    when -= std::chrono::duration_cast<std::chrono::system_clock::duration>(age);
  }
  return std::chrono::duration<double>(when.time_since_epoch()).count();
}

void write(std::FILE* file, const std::string& channel, const swarmtalk::Message& m) {
  std::fprintf(file, "%.6f,%s,%u,%u,%s,%s,%u,%llu,", seconds_since_1970(m), channel.c_str(),
               m.sender, m.message_number, number(m.distance_m).c_str(),
               number(m.bearing_rad).c_str(), m.hops,
               static_cast<unsigned long long>(m.lost_before.total()));
  for (const auto byte : m.bytes()) std::fprintf(file, "%02x", static_cast<unsigned>(byte));
  std::fprintf(file, "\n");
  if (std::fflush(file) != 0) running->stop();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::cerr << "usage: log_to_csv FILE CHANNEL...\n";
    return 2;
  }
  swarmtalk::Client robot("log_to_csv");
  if (auto status = robot.connect(); !status) {
    std::cerr << status.text() << "\n";
    return 1;
  }
  std::FILE* file = std::fopen(argv[1], "w");
  if (file == nullptr) {
    std::perror(argv[1]);
    return 1;
  }
  std::fprintf(file, "time,channel,sender,number,distance_m,bearing_rad,hops,lost,hex\n");
  std::vector<swarmtalk::Subscriber> subscribers;
  for (int i = 2; i < argc; ++i) {
    const std::string channel = argv[i];
    subscribers.push_back(robot.subscribe(
        channel, [file, channel](const swarmtalk::Message& m) { write(file, channel, m); }));
    if (auto status = subscribers.back().status(); !status) {
      std::cerr << status.text() << "\n";
      return 1;
    }
  }
  running = &robot;
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  std::cout << "writing to " << argv[1] << " until Ctrl-C" << std::endl;
  robot.run();
  const bool is_incomplete = std::ferror(file) != 0;
  if (std::fclose(file) != 0 || is_incomplete) {
    std::cerr << argv[1] << " is incomplete: is the disk full?\n";
    return 1;
  }
}
