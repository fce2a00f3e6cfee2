#include <algorithm>

#include <swarmtalk/client/harvest.hpp>

#include "cli/common/commands.hpp"
#include "cli/common/deadline.hpp"
#include "cli/common/link_watch.hpp"
#include "cli/text/format.hpp"
#include "cli/text/hex.hpp"
#include "text/utf8.hpp"

namespace swarmtalk::cli {
namespace {

std::string to_line(const HarvestedValue& value, bool is_json) {
  if (is_json) {
    Json json{{"node_id", value.node_id},  {"epoch", value.epoch}, {"hops", value.hops},
              {"local", value.local},      {"key", value.key},     {"text", nullptr},
              {"hex", to_hex(value.value)}};
    if (text::is_utf8(value.value)) json["text"] = value.value;
    return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  }
  return "robot " + std::to_string(value.node_id) + "  " + payload_text(value.key) + " = " +
         payload_text(value.value) + (value.local ? "  from this robot" : "") + "\n";
}

/// Until `written` is something else than kExitOk, a signal, or the deadline.
int run(Client& client, LinkWatch& links, Clock::time_point deadline, const int& written) {
  while (written == kExitOk && caught_signal() == 0 && Clock::now() < deadline) {
    links.look();
    client.run_once(std::min(deadline, links.next()) - Clock::now());
  }
  return caught_signal() == 0 ? written : kExitSignal + caught_signal();
}

}  // namespace

int harvest(const Common& common, const HarvestArguments& arguments) {
  Client client = make_client(common);
  if (const Status status = client.connect(); !status) return fail(status);
  stop_on_signals(client);
  Harvest harvest(client);
  if (const Status status = harvest.status(); !status) return fail(status);
  LinkWatch links(client);
  int written = kExitOk;
  if (!arguments.values.empty()) {
    tell_connection(client);
    for (const std::string& word : arguments.values) {
      const auto at = word.find('=');
      if (at == std::string::npos) return fail("--offer takes KEY=VALUE, not " + word, kExitUsage);
      const Status status = harvest.set(word.substr(0, at), word.substr(at + 1));
      if (!status) return fail(status);
    }
    return run(client, links, Clock::time_point::max(), written);
  }
  bool is_found = false;
  const auto found = [&](const HarvestedValue& value) {
    is_found = true;
    if (written == kExitOk) written = print(to_line(value, common.is_json));
  };
  // A daemon that comes back does not know the question.
  client.on_disconnect([&](const Status&) {
    if (written == kExitOk) written = fail("swarmtalkd closed the connection", kExitNoDaemon);
  });
  const Status asked = harvest.ask(arguments.prefix, found, arguments.ttl);
  if (!asked) return fail(asked);
  const auto deadline = after(Clock::now(), seconds(arguments.timeout_s));
  const int exit_code = run(client, links, deadline, written);
  if (exit_code == kExitOk && !is_found && !links.has_told()) {
    fail("nobody has answered: no program within reach offers a value" +
         (arguments.prefix.empty() ? "" : " whose key begins with '" + arguments.prefix + "'") +
         ", as swarmtalk-cli harvest --offer KEY=VALUE does, or question or answers were lost: "
         "ask again");
  }
  return exit_code;
}

}  // namespace swarmtalk::cli
