#include "cli/common/commands.hpp"
#include "cli/common/quiet_watch.hpp"
#include "cli/text/format.hpp"

namespace swarmtalk::cli {

namespace {

int show(const Common& common, std::string (*text_of)(const DaemonStatus&, const Look&)) {
  Client client = make_client(common);
  if (const Status connection = client.connect(); !connection) return fail(connection);
  DaemonStatus daemon;
  if (const Status answer = client.get_status(daemon); !answer) return fail(answer);
  return print(common.is_json ? to_json(daemon).dump() + "\n" : text_of(daemon, look_of_output()));
}

}  // namespace

int status(const Common& common) {
  return show(common, &to_text);
}

int neighbours(const Common& common) {
  Client client = make_client(common);
  if (const Status connection = client.connect(); !connection) return fail(connection);
  std::vector<Neighbour> heard;
  if (const Status answer = client.get_neighbours(heard); !answer) return fail(answer);
  DaemonStatus daemon;
  if (heard.empty() && !common.is_json && client.get_status(daemon) && has_just_begun(daemon)) {
    return print("nobody was heard yet: this daemon began less than 3 s ago; ask again\n");
  }
  return print(common.is_json ? to_json(heard).dump() + "\n"
                              : to_text(heard, look_of_output(), common.is_verbose));
}

int stats(const Common& common) {
  return show(common, &to_stats);
}

}  // namespace swarmtalk::cli
