#include "lab/air_commands.hpp"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <swarmtalk/client.hpp>
#include <thread>

#include "lab/interrupt.hpp"
#include "lab/lab.hpp"
#include "lab/medium_status.hpp"
#include "lab/radio/control_socket.hpp"
#include "usage/checks.hpp"
#include "usage/terminal.hpp"

namespace swarmtalk::lab {
namespace {

using nlohmann::json;

constexpr double kFarthestM = 100000;
constexpr auto kStep = std::chrono::milliseconds(50);

json request(const State& state, const json& what) {
  if (state.control_socket.empty()) {
    throw std::runtime_error("the medium " + state.medium +
                             " cannot be changed while it runs; start the lab with --medium radio");
  }
  json answer = json::parse(radio::ask(state.control_socket, what.dump()));
  if (answer.contains("error")) throw std::runtime_error(answer["error"].get<std::string>());
  return answer;
}

void print_link(const json& link) {
  std::printf("robot %d -> robot %d: %s by %.1f dB, loss %.0f %%\n", link.at("from").get<int>(),
              link.at("to").get<int>(),
              link.at("in_range").get<bool>() ? "in range" : "out of range",
              std::fabs(link.at("margin_db").get<double>()), link.at("loss").get<double>() * 100);
}

/// A robot's place, told to the medium and to its daemon.
class Mover {
 public:
  Mover(const State& state, const Robot& robot)
      : state_(state), robot_(robot), client_("swarmtalk-lab", options(robot)) {
    std::optional<swarmtalk::Pose> pose;
    swarmtalk::Status status = client_.connect();
    if (status.ok()) status = client_.get_pose(pose);
    if (!status.ok()) {
      throw std::runtime_error("robot " + std::to_string(robot.number) + ": " +
                               std::string(status.text()));
    }
    theta_rad_ = pose ? pose->theta_rad : static_cast<float>(robot.pose.theta_rad);
  }

  void put(double x_m, double y_m) {
    request(state_, {{"do", "move"}, {"robot", robot_.number}, {"x_m", x_m}, {"y_m", y_m}});
    client_.set_fixed_pose(static_cast<float>(x_m), static_cast<float>(y_m), theta_rad_);
    if (const swarmtalk::Status status = client_.sync(); !status.ok()) {
      throw std::runtime_error("robot " + std::to_string(robot_.number) + " stands at its new " +
                               "place, but its daemon was not told: " + std::string(status.text()));
    }
  }

 private:
  static swarmtalk::ClientOptions options(const Robot& robot) {
    swarmtalk::ClientOptions options;
    options.socket_path = robot.socket;
    return options;
  }

  const State& state_;
  const Robot& robot_;
  swarmtalk::Client client_;
  float theta_rad_ = 0;
};

}  // namespace

AirCommands::AirCommands(CLI::App& app) {
  link_ = app.add_subcommand("link", "Show or set the loss between two robots (--medium radio)");
  link_->add_option("A", from_, "Robot")->required();
  link_->add_option("B", to_, "Robot")->required();
  CLI::Option* loss = link_
                          ->add_option("--loss", loss_,
                                       "Share of frames that are lost on this link: 0 to 1; 1 "
                                       "cuts it")
                          ->check(usage::between(0, 1));
  link_->add_flag("--reset", is_reset_, "Lose as many as all other links")->excludes(loss);
  link_->add_flag("--one-way", is_one_way_, "From A to B only");

  move_ = app.add_subcommand("move", "Move a robot, and tell its daemon (--medium radio)");
  move_->add_option("ROBOT", robot_, "Robot")->required();
  const CLI::Validator place = usage::between(-kFarthestM, kFarthestM);
  move_->add_option("X", x_m_, "Metres")->required()->check(place);
  move_->add_option("Y", y_m_, "Metres")->required()->check(place);
  move_
      ->add_option("--speed", speed_mps_,
                   "Metres a second: go there in a straight line, and return when there; without "
                   "it the robot is there at once")
      ->check(usage::between(0.001, 1000));

  partition_ = app.add_subcommand("partition",
                                  "Let robots hear only each other, until heal (--medium radio)");
  CLI::Option* robots = partition_->add_option("ROBOTS", robots_, "A number, 1,4-6 or all");
  partition_->add_option("--line", line_x_m_, "Nothing crosses the line x = this many metres")
      ->check(place)
      ->excludes(robots);
  heal_ = app.add_subcommand("heal", "Take all partitions back (--medium radio)");

  jam_ = app.add_subcommand("jam", "Nothing is received within a circle (--medium radio)");
  jam_->add_option("X", jam_x_m_, "Metres")->check(place);
  jam_->add_option("Y", jam_y_m_, "Metres")->check(place);
  jam_->add_option("RADIUS", radius_m_, "Metres")->check(usage::between(0.001, kFarthestM));
  jam_->add_flag("--off", is_off_, "Take all jammers away");

  medium_ = app.add_subcommand("medium", "The medium of the lab (--medium radio)");
  medium_->require_subcommand(1);
  CLI::App* status = medium_->add_subcommand(
      "status", "Show frames, losses by cause, late events, processor time");
  status->add_flag("--json", as_json_, "One JSON object");
}

bool AirCommands::is_chosen() const {
  return *link_ || *move_ || *partition_ || *heal_ || *jam_ || *medium_;
}

int AirCommands::run(const State& state) const {
  if (*link_) return set_link(state);
  if (*move_) return move(state);
  if (*partition_) return partition(state);
  if (*jam_) return jam(state);
  if (*heal_) {
    request(state, {{"do", "heal"}});
    return 0;
  }
  const json status = request(state, {{"do", "status"}});
  if (as_json_) {
    std::printf("%s\n", status.dump().c_str());
  } else {
    std::fputs(usage::folded(medium_status_text(status), STDOUT_FILENO).c_str(), stdout);
  }
  return 0;
}

int AirCommands::set_link(const State& state) const {
  json there = {{"do", "link"}, {"from", from_}, {"to", to_}};
  if (loss_) there["loss"] = *loss_;
  if (is_reset_) there["loss"] = nullptr;
  json back = there;
  back["from"] = to_;
  back["to"] = from_;
  print_link(request(state, there));
  if (!is_one_way_) print_link(request(state, back));
  return 0;
}

int AirCommands::move(const State& state) const {
  const std::vector<Robot> robots = select_robots(state, std::to_string(robot_));
  const json status = request(state, {{"do", "status"}});
  const json& start = status.at("robots").at(static_cast<std::size_t>(robot_ - 1));
  const double x_m = start.at("x_m").get<double>();
  const double y_m = start.at("y_m").get<double>();
  Mover mover(state, robots.front());
  const double way_m = std::hypot(x_m_ - x_m, y_m_ - y_m);
  const auto begin = std::chrono::steady_clock::now();
  for (double share = speed_mps_ > 0 && way_m > 0 ? 0 : 1; share < 1;) {
    std::this_thread::sleep_for(kStep);
    if (interrupted() != 0) return 128 + interrupted();  // it stays where it has come to
    const std::chrono::duration<double> gone = std::chrono::steady_clock::now() - begin;
    share = std::min(1.0, gone.count() * speed_mps_ / way_m);
    mover.put(x_m + share * (x_m_ - x_m), y_m + share * (y_m_ - y_m));
  }
  mover.put(x_m_, y_m_);
  return 0;
}

int AirCommands::partition(const State& state) const {
  if (line_x_m_) {
    request(state, {{"do", "part"}, {"x_m", *line_x_m_}});
    return 0;
  }
  if (robots_.empty()) throw std::runtime_error("partition: name robots (1,4-6), or give --line X");
  json numbers = json::array();
  for (const Robot& robot : select_robots(state, robots_)) numbers.push_back(robot.number);
  request(state, {{"do", "part"}, {"robots", numbers}});
  return 0;
}

int AirCommands::jam(const State& state) const {
  if (is_off_ != !radius_m_.has_value() || (is_off_ && jam_x_m_)) {
    throw std::runtime_error("jam: give X Y RADIUS in metres, or --off");
  }
  if (is_off_) {
    request(state, {{"do", "unjam"}});
  } else {
    request(state,
            {{"do", "jam"}, {"x_m", *jam_x_m_}, {"y_m", *jam_y_m_}, {"radius_m", *radius_m_}});
  }
  return 0;
}

}  // namespace swarmtalk::lab
