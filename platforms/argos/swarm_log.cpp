#include "platforms/argos/swarm_log.hpp"

#include <argos3/core/simulator/entity/composable_entity.h>
#include <argos3/core/simulator/entity/controllable_entity.h>
#include <argos3/core/simulator/simulator.h>
#include <argos3/core/simulator/space/space.h>
#include <argos3/core/simulator/visualization/default_visualization.h>

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "usage/ending_signals.hpp"

namespace swarmtalk::platforms::in_argos {
namespace {

constexpr uint32_t kPoseSteps = 8;  // a quarter of a second between two poses of one robot
constexpr double kMmPerM = 1000;

/// Not 0 from the first SIGINT, SIGTERM or SIGHUP on.
volatile std::sig_atomic_t stopped = 0;
/// Not 0 when the experiment is over and its log, if any, is written.
volatile std::sig_atomic_t is_over = 0;

/// For how long a window may go on after the first signal: paused, it does no step that would see
/// it.
constexpr unsigned kLastSeconds = 2;

bool has_window() {
  auto& shown = argos::CSimulator::GetInstance().GetVisualization();
  return dynamic_cast<argos::CDefaultVisualization*>(&shown) == nullptr;
}

void on_signal(int) {
  stopped = 1;
}

void on_signal_at_window(int) {
  if (is_over != 0) std::_Exit(EXIT_SUCCESS);
  stopped = 1;
  alarm(kLastSeconds);
}

void end_as_interrupted(int) {
  std::signal(SIGINT, SIG_DFL);
  std::raise(SIGINT);
}

/// The reach of a robot's radio as its experiment file says it, in mm; 0: it does not.
double range_mm(argos::CEntity& robot) {
  argos::TConfigurationNode* node = robot.GetConfigurationNode();
  double range = 0;
  if (node == nullptr) return 0;
  argos::GetNodeAttributeOrDefault(*node, "communication_range", range, range);
  argos::GetNodeAttributeOrDefault(*node, "rab_range", range, range);
  return range * kMmPerM;
}

bool is_footbot(const SteppedRobot& robot) {
  return std::strcmp(robot.platform(), FootbotModel::kPlatform) == 0;
}

}  // namespace

void SwarmLog::Init(argos::TConfigurationNode& node) {
  std::string scenario;
  if (argos::NodeExists(node, "params")) {
    argos::TConfigurationNode& params = argos::GetNode(node, "params");
    argos::GetNodeAttributeOrDefault(params, "log", path_, path_);
    argos::GetNodeAttributeOrDefault(params, "scenario", scenario, scenario);
  }
  find_robots();
  if (!path_.empty()) {
    std::ifstream file(scenario);
    if (!std::getline(file, header_)) {
      THROW_ARGOSEXCEPTION("cannot read the scenario '"
                           << scenario << "': name a file that begins with the log's first line");
    }
    open_log();
  }
  std::signal(SIGALRM, &end_as_interrupted);
  usage::catch_ending_signals(has_window() ? &on_signal_at_window : &on_signal, SA_RESTART);
  begun_ = std::clock();
}

void SwarmLog::find_robots() {
  for (argos::CEntity* entity : GetSpace().GetEntityVector()) {
    auto* controllable = dynamic_cast<argos::CControllableEntity*>(entity);
    if (controllable == nullptr) continue;
    auto* controller = dynamic_cast<Controller*>(&controllable->GetController());
    if (controller == nullptr) continue;  // somebody else's
    auto& whole = dynamic_cast<argos::CComposableEntity&>(controllable->GetRootEntity());
    auto& body = whole.GetComponent<argos::CEmbodiedEntity>("body");
    const argos::CVector3& at = body.GetOriginAnchor().Position;
    const Standing standing = {at.GetX() * kMmPerM, at.GetY() * kMmPerM, range_mm(whole)};
    sites_.push_back({controller, &body, standing, 0});
  }
  if (sites_.empty()) {
    THROW_ARGOSEXCEPTION("no robot of this experiment has a controller of SwarmTalk");
  }
  const auto index = [](const Site& site) { return site.controller->robot().index(); };
  std::stable_sort(sites_.begin(), sites_.end(),
                   [&](const Site& a, const Site& b) { return index(a) < index(b); });
  for (size_t i = 0; i < sites_.size(); ++i) {
    if (index(sites_[i]) == i) continue;
    THROW_ARGOSEXCEPTION("there is no robot with index=\""
                         << i << "\": indices count from 0, and no two robots have the same");
  }
}

void SwarmLog::open_log() {
  log_ = std::fopen(path_.c_str(), "w");
  if (log_ == nullptr) {
    THROW_ARGOSEXCEPTION("cannot write " << path_ << ": " << std::strerror(errno));
  }
  std::fprintf(log_, "%s\n", header_.c_str());
  for (Site& site : sites_) site.controller->robot().start_log();
  write_links();
}

void SwarmLog::write_links() {
  std::vector<Standing> places;
  for (const Site& site : sites_) places.push_back(site.standing);
  for (size_t i = 0; i < sites_.size(); ++i) {
    if (places[i].range_mm <= 0) continue;
    // Foot-bots stand in each other's sight; the Kilobot plugin knows no obstacles.
    const bool hides = is_footbot(sites_[i].controller->robot());
    std::string list;
    for (const uint32_t to : listeners(places, i, hides ? double{FootbotModel::kBodyMm} : 0)) {
      list += (list.empty() ? "" : ",") + std::to_string(to);
    }
    std::fprintf(log_, "{\"t\":0,\"robot\":%zu,\"event\":\"links\",\"to\":[%s]}\n", i,
                 list.c_str());
  }
}

/// ARGoS's window starts the experiment anew, and so does the log; one that has its end stays.
void SwarmLog::Reset() {
  if (log_ == nullptr) return;
  std::fclose(log_);
  log_ = nullptr;
  sites_.clear();
  find_robots();
  open_log();
}

void SwarmLog::PostStep() {
  if (log_ == nullptr) return;
  const bool is_time = GetSpace().GetSimulationClock() % kPoseSteps == 0;
  for (Site& site : sites_) {
    SteppedRobot& robot = site.controller->robot();
    const Wheels& wheels = robot.wheels();
    const bool moves = wheels.left_mm_per_s != 0 || wheels.right_mm_per_s != 0;
    if (moves && site.body->IsCollidingWithSomething()) ++site.contacts;
    if (is_time) write_pose(site);
    const std::string lines = robot.take_log();
    std::fwrite(lines.data(), 1, lines.size(), log_);
  }
}

void SwarmLog::write_pose(Site& site) {
  const argos::SAnchor& anchor = site.body->GetOriginAnchor();
  argos::CRadians z;
  argos::CRadians y;
  argos::CRadians x;
  anchor.Orientation.ToEulerAngles(z, y, x);
  const double x_mm = anchor.Position.GetX() * kMmPerM;
  const double y_mm = anchor.Position.GetY() * kMmPerM;
  const bool stands = std::abs(x_mm - site.standing.x_mm) < 0.05 &&
                      std::abs(y_mm - site.standing.y_mm) < 0.05 &&
                      std::abs(z.GetValue() - site.theta_rad) < 0.0005;
  if (stands) return;
  site.standing.x_mm = x_mm;
  site.standing.y_mm = y_mm;
  site.theta_rad = z.GetValue();
  site.controller->robot().log_pose(x_mm, y_mm, site.theta_rad);
}

bool SwarmLog::IsExperimentFinished() {
  return stopped != 0;
}

double SwarmLog::seconds() const {
  return static_cast<double>(GetSpace().GetSimulationClock()) / kStepsPerSecond;
}

void SwarmLog::PostExperiment() {
  const double cpu_s = static_cast<double>(std::clock() - begun_) / CLOCKS_PER_SEC;
  argos::LOG << "[INFO] swarmtalk: " << sites_.size() << " robots, " << seconds()
             << " s simulated in " << cpu_s << " s of processor time, "
             << (cpu_s > 0 ? seconds() / cpu_s : 0) << " times real time" << std::endl;
  if (!close_log()) THROW_ARGOSEXCEPTION("cannot write " << path_ << ": is the disk full?");
  is_over = 1;
  // A window stays open when its experiment is over, but not after Ctrl-C.
  if (stopped != 0 && has_window()) std::_Exit(EXIT_SUCCESS);
}

/// Also of a window that was closed before the end.
void SwarmLog::Destroy() {
  if (!close_log()) argos::LOGERR << "cannot write " << path_ << ": is the disk full?" << std::endl;
}

bool SwarmLog::close_log() {
  if (log_ == nullptr) return true;
  for (Site& site : sites_) {
    site.controller->robot().log_end(site.contacts);
    const std::string lines = site.controller->robot().take_log();
    std::fwrite(lines.data(), 1, lines.size(), log_);
  }
  std::fprintf(log_, "{\"event\":\"air\",\"seconds\":%.6f}\n", seconds());
  const bool failed = std::ferror(log_) != 0;
  const bool closed = std::fclose(log_) == 0;
  log_ = nullptr;
  return !failed && closed;
}

}  // namespace swarmtalk::platforms::in_argos

// ARGoS makes names of its own out of the class's, which must be one word.
using SwarmtalkLog = swarmtalk::platforms::in_argos::SwarmLog;
REGISTER_LOOP_FUNCTIONS(SwarmtalkLog, "swarmtalk_log")
