// Verbs of an operator that ask the running daemon one thing: reload, log-level, node-id, metrics.
#include <string>

#include "cli/common/commands.hpp"
#include "cli/common/operator.hpp"

namespace swarmtalk::cli {

int reload(const Common& common) {
  OperatorConnection daemon;
  if (const Status status = daemon.open(common.socket_path); !status) return fail(status);
  ipc::Envelope question;
  ipc::Envelope answer;
  question.mutable_reload();
  if (const Status status = daemon.request(question, answer); !status) return fail(status);
  std::string text;
  for (const std::string& key : answer.reloaded().applied()) text += "applied: " + key + "\n";
  for (const std::string& key : answer.reloaded().needs_restart()) {
    text += "needs a restart: " + key + "\n";
  }
  const std::string& stays = answer.reloaded().node_id_stays();
  if (!stays.empty()) text += "the node id stays as it is: " + stays + "\n";
  return print(text.empty() ? "nothing has changed\n" : text);
}

int log_level(const Common& common, const LogLevelArguments& arguments) {
  OperatorConnection daemon;
  if (const Status status = daemon.open(common.socket_path); !status) return fail(status);
  ipc::Envelope question;
  ipc::Envelope answer;
  ipc::SetLogLevel& request = *question.mutable_set_log_level();
  if (!arguments.level.empty()) request.set_level(arguments.level);
  if (!arguments.subsystem.empty()) request.set_subsystem(arguments.subsystem);
  if (const Status status = daemon.request(question, answer); !status) return fail(status);
  std::string text;
  for (const ipc::LogLevel& level : answer.log_levels().levels()) {
    text += level.subsystem() + " " + level.level() + "\n";
  }
  return print(text);
}

int node_id(const Common& common, const std::string& id) {
  OperatorConnection daemon;
  if (const Status status = daemon.open(common.socket_path); !status) return fail(status);
  ipc::Envelope question;
  ipc::Envelope answer;
  question.mutable_set_node_id();
  if (id != "auto") {
    question.mutable_set_node_id()->set_node_id(static_cast<std::uint32_t>(std::stoul(id)));
  }
  const Status status = daemon.request(question, answer);
  return status ? kExitOk : fail(status);
}

int metrics(const Common& common) {
  OperatorConnection daemon;
  if (const Status status = daemon.open(common.socket_path); !status) return fail(status);
  ipc::Envelope question;
  ipc::Envelope answer;
  question.mutable_get_metrics();
  if (const Status status = daemon.request(question, answer); !status) return fail(status);
  return print(answer.metrics().text());
}

}  // namespace swarmtalk::cli
