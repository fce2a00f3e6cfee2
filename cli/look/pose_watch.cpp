#include "cli/common/commands.hpp"
#include "cli/common/deadline.hpp"
#include "cli/common/looking.hpp"
#include "cli/text/format.hpp"

namespace swarmtalk::cli {

int watch_pose(const Common& common, const PoseWatchArguments& arguments) {
  Client client = make_client(common);
  if (const Status status = client.connect(); !status) return fail(status);
  stop_on_signals(client);
  tell_connection(client);
  int written = kExitOk;
  auto next = Clock::now();
  for (std::uint64_t told = 0; arguments.count == 0 || told < arguments.count;) {
    std::optional<Pose> pose;
    if (const Status status = client.get_pose(pose)) {
      ++told;
      const std::string time = iso_time(Clock::now());
      written = print(common.is_json ? Json{{"time", time}, {"pose", to_json(pose)}}.dump() + "\n"
                                     : time + "  " + (pose ? to_line(*pose) : "unknown") + "\n");
      if (written != kExitOk) break;
    }
    next = after(next, seconds(arguments.period_s));
    while (caught_signal() == 0 && Clock::now() < next &&
           (arguments.count == 0 || told < arguments.count)) {
      client.run_once(next - Clock::now());
    }
    if (caught_signal() != 0) return kExitSignal + caught_signal();
  }
  return written;
}

}  // namespace swarmtalk::cli
