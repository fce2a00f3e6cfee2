// swarmtalk-suite-robot SCENARIO FOLDER: one robot of a swarm whose radios belong to daemons; real
// time. Run once on each robot of a lab (swarmtalk-lab exec all), whose number SWARMTALK_ROBOT
// says. Writes FOLDER/NUMBER.jsonl, with the times of the system's monotonic clock. Ctrl-C ends it
// with what it has.
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <string>

#include "platforms/coachbot/daemon_robot.hpp"
#include "platforms/observed_robot.hpp"
#include "suite/programs/make.hpp"
#include "suite/sim/program_main.hpp"
#include "suite/sim/scenario.hpp"

namespace {

using namespace swarmtalk;

using Robot = platforms::ObservedRobot<platforms::DaemonRobot>;

/// Robots are numbered from 1 in a lab and from 0 in a scenario.
uint32_t index_from_environment(size_t robots) {
  const char* text = std::getenv("SWARMTALK_ROBOT");
  const unsigned long number = text == nullptr ? 0 : std::strtoul(text, nullptr, 10);
  if (number < 1 || number > robots) {
    throw std::runtime_error("SWARMTALK_ROBOT must be 1 to " + std::to_string(robots) +
                             "; run this with swarmtalk-lab exec");
  }
  return static_cast<uint32_t>(number - 1);
}

void write_end(platforms::Recorder& recorder, const Robot& robot, Client& client,
               const platforms::BodyPort& body) {
  const Loss& lost = robot.lost();
  recorder.event(
      robot.time_us(), robot.index(),
      "\"event\":\"end\",\"node\":%u,\"lost_air\":%llu,\"lost_kernel\":%llu,"
      "\"lost_daemon\":%llu,\"lost_client\":%llu,\"body_commands_unsent\":%u",
      static_cast<unsigned>(client.node_id()), static_cast<unsigned long long>(lost.air),
      static_cast<unsigned long long>(lost.kernel), static_cast<unsigned long long>(lost.daemon),
      static_cast<unsigned long long>(lost.client), static_cast<unsigned>(body.unsent()));
}

template <class Program>
void run(const suite::Scenario& scenario, uint32_t index, const std::string& body_path,
         std::FILE* log) {
  platforms::BodyPort body(body_path);
  Client client = Client::connected("swarmtalk-suite");
  platforms::Recorder recorder(log);
  const suite::Placement& place = scenario.robots[index];
  Robot robot(recorder, client, body, index, scenario.seed);
  std::optional<Program> program;
  suite::make(program, static_cast<Program*>(nullptr), robot, place.role, index);
  suite::configure(*program, scenario);
  const uint64_t start_us = robot.time_us();
  recorder.event(start_us, index, "\"event\":\"start\",\"node\":%u",
                 static_cast<unsigned>(client.node_id()));
  program->setup();
  const uint64_t end_us = start_us + static_cast<uint64_t>(scenario.seconds * 1e6);
  uint64_t next_us = start_us;
  while (suite::stopped == 0 && robot.time_us() < end_us) {
    robot.poll();
    program->loop();
    next_us += sim::kTickUs;
    for (uint64_t now_us = robot.time_us(); now_us < next_us && suite::stopped == 0;
         now_us = robot.time_us()) {
      if (const Status status = client.run_once(std::chrono::microseconds(next_us - now_us));
          status.code() == StatusCode::kBadArgument) {
        throw std::runtime_error(std::string(status.text()));
      }
    }
  }
  robot.stop();
  write_end(recorder, robot, client, body);
}

void run_scenario(const std::string& path, const std::string& folder) {
  const suite::Scenario scenario = suite::read_scenario(path);
  const uint32_t index = index_from_environment(scenario.robots.size());
  const std::string log_path = folder + "/" + std::to_string(index) + ".jsonl";
  suite::LogFile log(log_path);
  const char* given = std::getenv("SWARMTALK_BODY");
  const std::string body = given != nullptr ? given : folder + "/body-" + std::to_string(index);
  const bool known = suite::with_program<Robot>(scenario.program, [&](auto* program) {
    run<std::remove_pointer_t<decltype(program)>>(scenario, index, body, log.get());
  });
  if (!known) throw std::runtime_error("no program '" + scenario.program + "'");
  log.finish();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: swarmtalk-suite-robot SCENARIO FOLDER; see swarmtalk-suite\n");
    return 2;
  }
  return suite::program_main("swarmtalk-suite-robot", [argv] {
    run_scenario(argv[1], argv[2]);
    return 0;
  });
}
