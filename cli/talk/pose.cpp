#include <cmath>
#include <cstdlib>
#include <numbers>

#include "cli/common/commands.hpp"
#include "cli/text/format.hpp"

namespace swarmtalk::cli {
namespace {

/// "1.57" radians, "90deg" degrees; nullopt if it is neither.
std::optional<double> parse_angle(const std::string& word) {
  char* end = nullptr;
  const double value = std::strtod(word.c_str(), &end);
  const std::string unit(end);
  if (end == word.c_str()) return std::nullopt;
  if (unit.empty() || unit == "rad") return value;
  if (unit == "deg") return value * std::numbers::pi / 180;
  return std::nullopt;
}

}  // namespace

int set_pose(const Common& common, const PoseArguments& arguments) {
  const auto theta = parse_angle(arguments.theta);
  if (!theta) return fail("THETA is radians, or degrees as in 90deg", kExitUsage);
  if (arguments.theta.find("deg") == std::string::npos && std::abs(*theta) > 2 * std::numbers::pi) {
    return fail("THETA " + arguments.theta + " is more than a whole turn in radians; degrees are " +
                    arguments.theta + "deg",
                kExitUsage);
  }
  Client client = make_client(common);
  if (const Status status = client.connect(); !status) return fail(status);
  const auto wrapped = static_cast<float>(std::remainder(*theta, 2 * std::numbers::pi));
  Status status = arguments.is_ageing
                      ? client.set_pose(arguments.x_m, arguments.y_m, wrapped)
                      : client.set_fixed_pose(arguments.x_m, arguments.y_m, wrapped);
  if (status) status = client.sync();
  return status ? kExitOk : fail(status);
}

int get_pose(const Common& common) {
  Client client = make_client(common);
  if (const Status status = client.connect(); !status) return fail(status);
  std::optional<Pose> pose;
  if (const Status status = client.get_pose(pose); !status) return fail(status);
  if (common.is_json) {
    if (const int written = print(to_json(pose).dump() + "\n"); written != kExitOk) return written;
  }
  if (pose && common.is_json) return kExitOk;
  DaemonStatus daemon;
  if (const Status status = client.get_status(daemon); !status) return fail(status);
  if (!pose) {
    return fail("this robot has no valid pose: " + pose_text(daemon) +
                "; try: swarmtalk-cli pose set X Y THETA");
  }
  daemon.pose = pose;
  return print(pose_text(daemon) + "\n");
}

}  // namespace swarmtalk::cli
