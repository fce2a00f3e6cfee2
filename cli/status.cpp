#include "cli/commands.hpp"
#include "cli/format.hpp"

namespace swarmtalk::cli {

int status(const Common& common) {
  Client client = make_client(common);
  if (const Status connection = client.connect(); !connection) return fail(connection);
  DaemonStatus daemon;
  if (const Status answer = client.get_status(daemon); !answer) return fail(answer);
  return print(common.is_json ? to_json(daemon).dump() + "\n" : to_text(daemon));
}

}  // namespace swarmtalk::cli
