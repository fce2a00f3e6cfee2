#include "cli/look/radar_view.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "cli/text/columns.hpp"
#include "cli/text/format.hpp"

namespace swarmtalk::cli {
namespace {

constexpr double kColumnsPerRow = 2;  // a character is twice as high as it is wide
constexpr std::chrono::milliseconds kFresh{1000};
constexpr std::chrono::milliseconds kOld{3000};

bool has_place(const Neighbour& each) {
  return std::isfinite(each.distance_m) && std::isfinite(each.bearing_rad);
}

/// 7 is fresh, 7~ is over a second old, 7? over three.
std::string mark(const Neighbour& each) {
  const char* age = each.age < kFresh ? "" : each.age < kOld ? "~" : "?";
  return std::to_string(each.node_id) + age;
}

class Plot {
 public:
  Plot(std::size_t width, std::size_t height)
      : rows_(height, std::string(width, ' ')),
        radius_(std::max(1.0, std::min(static_cast<double>(height - 1) / 2,
                                       static_cast<double>(width - 1) / 2 / kColumnsPerRow))),
        middle_x_(static_cast<double>(width - 1) / 2),
        middle_y_(static_cast<double>(height - 1) / 2) {}

  void ring(double share) {
    constexpr int kSteps = 360;
    for (int i = 0; i < kSteps; ++i) {
      const double angle = 2 * std::numbers::pi * i / kSteps;
      put(share * std::cos(angle), share * std::sin(angle), ".", false);
    }
  }
  /// @param ahead, left  shares of the range
  /// @return false: something is there
  bool put(double ahead, double left, const std::string& text, bool is_kept) {
    const auto row = static_cast<long>(std::lround(middle_y_ - ahead * radius_));
    auto column = static_cast<long>(std::lround(middle_x_ - left * radius_ * kColumnsPerRow));
    if (row < 0 || row >= static_cast<long>(rows_.size())) return false;
    std::string& line = rows_[static_cast<std::size_t>(row)];
    const auto size = static_cast<long>(text.size());
    column = std::clamp(column, 0L, std::max(0L, static_cast<long>(line.size()) - size));
    const auto at = static_cast<std::size_t>(column);
    const std::string there = line.substr(at, text.size());
    if (is_kept && there.find_first_not_of(". ") != std::string::npos) return false;
    line.replace(at, text.size(), text, 0, line.size() - at);
    return true;
  }
  std::vector<std::string> lines() const {
    std::vector<std::string> lines = rows_;
    for (std::string& line : lines) line.erase(line.find_last_not_of(' ') + 1);
    return lines;
  }

 private:
  std::vector<std::string> rows_;
  double radius_;
  double middle_x_;
  double middle_y_;
};

void list(const char* title, const std::vector<std::string>& marks, std::size_t width,
          std::vector<std::string>& lines) {
  if (marks.empty()) return;
  std::string line = title;
  for (const std::string& each : marks) line += " " + each;
  lines.push_back(clip(line, width));
}

}  // namespace

double radar_range_m(const std::vector<Neighbour>& neighbours, double wish_m) {
  if (wish_m > 0) return wish_m;
  double farthest = 0.1;
  for (const Neighbour& each : neighbours) {
    if (has_place(each)) farthest = std::max(farthest, static_cast<double>(each.distance_m));
  }
  const double power = std::pow(10, std::floor(std::log10(farthest)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (farthest <= step * power * 1.0001) return step * power;
  }
  return 10 * power;
}

std::vector<std::string> radar_lines(const std::vector<Neighbour>& neighbours,
                                     const RadarLook& look) {
  const double range_m = radar_range_m(neighbours, look.range_m);
  std::vector<std::string> unplaced;
  std::vector<std::string> beyond;
  std::vector<const Neighbour*> behind;
  std::vector<const Neighbour*> placed;
  for (const Neighbour& each : neighbours) {
    if (!has_place(each)) {
      unplaced.push_back(mark(each));
    } else if (static_cast<double>(each.distance_m) > range_m) {
      beyond.push_back(mark(each));
    } else {
      placed.push_back(&each);
    }
  }
  // The freshest are drawn first: what has no room beside them is listed.
  std::stable_sort(placed.begin(), placed.end(),
                   [](const auto* a, const auto* b) { return a->age < b->age; });
  const std::size_t below = 5;
  Plot plot(std::max<std::size_t>(look.width, 10),
            look.height > below + 3 ? look.height - below : 3);
  plot.ring(0.5);
  plot.ring(1);
  plot.put(0, 0, "^", true);
  for (const Neighbour* each : placed) {
    const double share = static_cast<double>(each->distance_m) / range_m;
    const auto bearing = static_cast<double>(each->bearing_rad);
    if (!plot.put(share * std::cos(bearing), share * std::sin(bearing), mark(*each), true)) {
      behind.push_back(each);
    }
  }
  std::vector<std::string> lines = plot.lines();
  lines.push_back(clip(std::to_string(neighbours.size()) + " heard; rings at " +
                           metres(static_cast<float>(range_m / 2)) + " and " +
                           metres(static_cast<float>(range_m)),
                       look.width));
  lines.push_back(clip("^ us, heading up; 7~ 1 s old, 7? 3 s", look.width));
  std::sort(behind.begin(), behind.end(),
            [](const auto* a, const auto* b) { return a->node_id < b->node_id; });
  std::vector<std::string> behind_marks;
  for (const Neighbour* each : behind) behind_marks.push_back(mark(*each));
  list("no room to draw:", behind_marks, look.width, lines);
  list("farther:", beyond, look.width, lines);
  list("place unknown:", unplaced, look.width, lines);
  return lines;
}

}  // namespace swarmtalk::cli
