#include "cli/look/radar_view.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>

#include "cli/common/deadline.hpp"
#include "cli/common/looking.hpp"
#include "cli/look/screen.hpp"
#include "cli/text/format.hpp"
#include "cli/text/table.hpp"

namespace swarmtalk::cli {
namespace {

int write_radar(const Common& common, const std::vector<Neighbour>& neighbours, double range_m) {
  std::string text;
  if (common.is_json) {
    text = to_json(neighbours).dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  } else {
    RadarLook look;
    look.range_m = range_m;
    if (const std::size_t columns = look_of_output().columns; columns != 0) look.width = columns;
    for (const std::string& line : radar_lines(neighbours, look)) text += line + "\n";
  }
  return print(text);
}

}  // namespace

int radar(const Common& common, const ScreenArguments& arguments) {
  Client client = make_client(common);
  if (const Status status = client.connect(); !status) return fail(status);
  interrupt_on_signals();
  Screen screen;
  const bool has_screen = !arguments.is_once && !common.is_json;
  if (has_screen) {
    if (const std::string problem = screen.open("radar"); !problem.empty()) return fail(problem);
  }
  RadarLook look;
  look.range_m = arguments.range_m;
  Status status;
  auto next = Clock::now();
  for (std::uint64_t shown = 1; caught_signal() == 0; ++shown) {
    std::vector<Neighbour> neighbours;
    status = client.get_neighbours(neighbours);
    if (!status) break;
    if (!has_screen) {
      const int written = write_radar(common, neighbours, arguments.range_m);
      if (written != kExitOk || arguments.is_once || shown == arguments.count) return written;
    }
    next = after(next, seconds(arguments.period_s));
    for (bool is_ended = false; caught_signal() == 0 && Clock::now() < next;) {
      if (has_screen) {
        look.width = screen.width();
        look.height = screen.height() - 1;
        std::vector<std::string> lines = radar_lines(neighbours, look);
        lines.push_back("q quit  + - range");
        screen.draw(lines);
      }
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(next - Clock::now()).count();
      pollfd descriptors[] = {{has_screen ? STDIN_FILENO : -1, POLLIN, 0}};
      ::poll(descriptors, 1, static_cast<int>(std::clamp<std::int64_t>(left, 0, 3'600'000)));
      if (!has_screen) continue;
      is_ended = (descriptors[0].revents & (POLLHUP | POLLERR)) != 0;
      for (int key = screen.key(); key != Screen::kNoKey; key = screen.key()) {
        is_ended = is_ended || key == 'q';
        if (key == '+' || key == '-') {
          look.range_m = radar_range_m(neighbours, look.range_m) * (key == '+' ? 0.5 : 2);
        }
      }
      if (is_ended) return kExitOk;
    }
  }
  screen.close();
  if (!status) return fail_of_screen(status);
  return kExitSignal + caught_signal();
}

}  // namespace swarmtalk::cli
