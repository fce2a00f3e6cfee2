#include "lab/medium_status.hpp"

#include <array>
#include <cstdio>
#include <utility>

#include "sim/wifi_air_config.hpp"

namespace swarmtalk::lab {
namespace {

using nlohmann::json;

template <typename... Values>
std::string line(const char* format, Values... values) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

unsigned long long count(const json& object, const char* key) {
  return object.at(key).get<unsigned long long>();
}

double share(unsigned long long part, unsigned long long whole) {
  return whole == 0 ? 0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

std::string lost_line(const char* name, unsigned long long lost, unsigned long long whole,
                      const char* meaning) {
  if (lost == 0) return {};
  return line("  %-10s %10llu  %5.1f %%  %s\n", name, lost, share(lost, whole), meaning);
}

std::string changes(const json& status) {
  std::string text;
  for (const json& link : status.at("links")) {
    text += line("link %d -> %d: loss %.0f %%\n", link.at("from").get<int>(),
                 link.at("to").get<int>(), link.at("loss").get<double>() * 100);
  }
  for (const json& x_m : status.at("lines_x_m")) {
    text += line("nothing crosses the line x = %.2f m\n", x_m.get<double>());
  }
  int parts = 0;
  for (const json& robot : status.at("robots")) {
    parts = std::max(parts, robot.at("part").get<int>());
  }
  for (int part = 1; part <= parts; ++part) {
    std::string members;
    for (const json& robot : status.at("robots")) {
      if (robot.at("part").get<int>() != part) continue;
      members += (members.empty() ? "" : ",") + std::to_string(robot.at("robot").get<int>());
    }
    if (!members.empty()) text += "by themselves: " + members + "\n";
  }
  for (const json& jammer : status.at("jammers")) {
    text += line("jammed: within %.2f m of (%.2f, %.2f)\n", jammer.at("radius_m").get<double>(),
                 jammer.at("x_m").get<double>(), jammer.at("y_m").get<double>());
  }
  return text;
}

}  // namespace

std::string medium_status_text(const json& status) {
  const double seconds = status.at("seconds").get<double>();
  double neighbours = 0;
  for (const json& robot : status.at("robots")) neighbours += robot.at("in_range").get<double>();
  const std::size_t robots = status.at("robots").size();
  std::string text =
      line("%zu robots, %.1f in range of each; range %.2f m, %d Mb/s, loss %.0f %%; for %.0f s\n",
           robots, neighbours / static_cast<double>(robots), status.at("range_m").get<double>(),
           status.at("rate_mbps").get<int>(), status.at("loss").get<double>() * 100, seconds);
  text += changes(status);
  const auto sent = count(status, "sent");
  text += line("%llu frames sent (%llu found the air taken); on the air %.1f %% of the time\n",
               sent, count(status, "deferred"),
               share(count(status, "air_us"), static_cast<unsigned long long>(seconds * 1e6)));
  const json& lost = status.at("lost");
  const auto offered = count(status, "offered");
  text += lost_line("queue full", count(lost, "queue_full"), offered,
                    "of frames offered: the robot's queue was full");
  text += lost_line("interface", count(lost, "interface"), offered,
                    "of frames offered: the medium had no time to fetch them");
  const auto received = count(status, "received");
  const auto in_range = count(status, "expected") - count(lost, "range");
  text += line("%llu received: %.1f %% of those sent to a robot in range; the others by cause:\n",
               received, share(received, in_range));
  for (const sim::WifiAirLoss& loss : sim::wifi_air_losses()) {
    const bool is_range = loss.count == &sim::WifiAirCounters::lost_range;
    text += lost_line(loss.name, count(lost, loss.name),
                      is_range ? count(status, "expected") : in_range, loss.meaning);
  }
  const json& late = status.at("late");
  text += line("late: %llu of %llu events (%.2f %%) by more than %llu us; half within %llu us, ",
               count(late, "late"), count(late, "events"),
               share(count(late, "late"), count(late, "events")), count(late, "limit_us"),
               count(late, "p50_us"));
  text +=
      line("99 %% within %llu us, worst %llu us\n", count(late, "p99_us"), count(late, "worst_us"));
  text += line("processor: %.1f %% of one, scheduled %s (pid %d)\n",
               share(static_cast<unsigned long long>(status.at("cpu_s").get<double>() * 1e6),
                     static_cast<unsigned long long>(seconds * 1e6)),
               status.at("scheduling").get<std::string>().c_str(), status.at("pid").get<int>());
  return text;
}

}  // namespace swarmtalk::lab
