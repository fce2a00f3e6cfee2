#include <poll.h>
#include <unistd.h>

#include <algorithm>

#include "cli/common/looking.hpp"
#include "cli/look/screen.hpp"
#include "cli/look/top_view.hpp"
#include "cli/text/columns.hpp"
#include "cli/text/numbers.hpp"
#include "cli/text/table.hpp"

namespace swarmtalk::cli {
namespace {

/// Of UTF-8: keys come byte by byte.
void drop_last_character(std::string& text) {
  const auto is_continued = [](char byte) { return (byte & 0xC0) == 0x80; };
  while (!text.empty() && is_continued(text.back())) text.pop_back();
  if (!text.empty()) text.pop_back();
}

/// What `top` asks again and again, and what the user wants to see of it.
class Top {
 public:
  Top(const Common& common, const ScreenArguments& arguments)
      : common_(common),
        arguments_(arguments),
        client_(make_client(common)),
        air_(common.socket_path) {
    look_.filter = arguments.filter;
    if (!arguments.sort.empty()) look_.sort = arguments.sort;
    if (const std::size_t columns = look_of_output().columns; columns != 0) look_.width = columns;
  }

  int run() {
    if (const Status status = client_.connect(); !status) return fail(status);
    if (const Status status = air_.open(); !status) return fail(status);
    interrupt_on_signals();
    Screen screen;
    const bool has_screen = !arguments_.is_once && !common_.is_json;
    if (has_screen) {
      if (const std::string problem = screen.open("top"); !problem.empty()) return fail(problem);
    }
    TopState before;
    Status status = ask(before);
    auto begin = Clock::now();
    for (std::uint64_t shown = 0; status && !is_ended_; ++shown) {
      // The first figures come soon, the others each period.
      const double period_s = shown == 0 ? std::min(arguments_.period_s, 1.0) : arguments_.period_s;
      const auto end = after(begin, seconds(period_s));
      while (status && !is_ended_ && caught_signal() == 0 && Clock::now() < end) {
        if (has_screen) draw(screen);
        status = wait(end, has_screen ? &screen : nullptr);
      }
      if (!status || is_ended_ || caught_signal() != 0) break;
      TopState now;
      status = ask(now);
      const double passed_s = std::chrono::duration<double>(Clock::now() - begin).count();
      begin = Clock::now();
      if (!status) break;
      if (!is_paused_) shown_ = top_json(before, now, passed_s);
      before = std::move(now);
      if (!has_screen && !write()) return written_;
      if (!has_screen && (arguments_.is_once || shown + 1 == arguments_.count)) return kExitOk;
    }
    screen.close();
    if (!status) return fail_of_screen(status);
    return caught_signal() == 0 ? kExitOk : kExitSignal + caught_signal();
  }

 private:
  Status ask(TopState& state) {
    if (const Status status = client_.get_status(state.daemon); !status) return status;
    if (const Status status = client_.get_neighbours(state.neighbours); !status) return status;
    state.air = air_.channels();
    state.sealed_frames = air_.sealed_frames();
    state.own_pid = static_cast<std::uint32_t>(::getpid());
    return Status();
  }

  Status wait(Clock::time_point end, Screen* screen) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now()).count();
    pollfd descriptors[] = {{air_.fd(), POLLIN, 0},
                            {screen != nullptr ? STDIN_FILENO : -1, POLLIN, 0}};
    ::poll(descriptors, 2, static_cast<int>(std::clamp<std::int64_t>(left, 0, 3'600'000)));
    if (screen != nullptr) {
      if ((descriptors[1].revents & (POLLHUP | POLLERR)) != 0) is_ended_ = true;
      for (int key = screen->key(); key != Screen::kNoKey; key = screen->key()) take(key);
    }
    return air_.look();
  }

  void take(int key) {
    if (is_typing_) {
      if (key == '\n' || key == '\r') {
        is_typing_ = false;
      } else if (key == Screen::kEscape) {
        is_typing_ = false;
        look_.filter.clear();
      } else if (key == Screen::kDelete || key == Screen::kBackspace || key == '\b') {
        drop_last_character(look_.filter);
      } else if (key >= ' ' && key < 256) {
        look_.filter += static_cast<char>(key);
      }
      return;
    }
    if (key == 'q') is_ended_ = true;
    const std::size_t page = shown_.is_null() ? 1 : top_page(shown_, look_);
    if (key == Screen::kDown || key == 'j') ++look_.down;
    if (key == Screen::kPageDown) look_.down += page;
    if (key == Screen::kUp || key == 'k') look_.down -= std::min<std::size_t>(look_.down, 1);
    if (key == Screen::kPageUp) look_.down -= std::min(look_.down, page);
    if (key == ' ') is_paused_ = !is_paused_;
    if (key == '/') {
      is_typing_ = true;
      look_.filter.clear();
      look_.down = 0;
    }
    if (key == 's') {
      look_.down = 0;
      look_.sort = look_.sort == "name" ? "rate" : look_.sort == "rate" ? "lost" : "name";
    }
  }

  void draw(Screen& screen) {
    look_.width = screen.width();
    look_.height = screen.height();
    const std::string filter = payload_name(look_.filter);
    look_.foot = is_typing_ ? "filter: " + filter + "_"
                            : "q quit s sort:" + look_.sort + " / filter" +
                                  (filter.empty() ? "" : ":" + filter) +
                                  (is_paused_ ? " PAUSED" : " space pause");
    if (shown_.is_null()) {
      screen.draw({"listening...", look_.foot});
    } else {
      look_.down = std::min(look_.down, top_most_down(shown_, look_));
      screen.draw(top_lines(shown_, look_));
    }
  }

  bool write() {
    std::string text;
    if (common_.is_json) {
      text = shown_.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
    } else {
      for (const std::string& line : top_lines(shown_, look_)) text += line + "\n";
    }
    written_ = print(text);
    return written_ == kExitOk;
  }

  const Common& common_;
  const ScreenArguments& arguments_;
  Client client_;
  AirWatch air_;
  TopLook look_;
  Json shown_;
  bool is_typing_ = false;
  bool is_paused_ = false;
  bool is_ended_ = false;
  int written_ = kExitOk;
};

}  // namespace

int top(const Common& common, const ScreenArguments& arguments) {
  return Top(common, arguments).run();
}

}  // namespace swarmtalk::cli
