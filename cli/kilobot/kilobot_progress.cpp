#include "cli/kilobot/kilobot_progress.hpp"

#include <algorithm>
#include <cstdio>

namespace swarmtalk::cli {
namespace {

constexpr std::uint32_t kBarWidth = 30;

}  // namespace

std::string minutes_text(std::uint64_t ms) {
  const std::uint64_t seconds = (ms + 999) / 1000;
  char text[32];
  std::snprintf(text, sizeof text, "%llu:%02llu", static_cast<unsigned long long>(seconds / 60),
                static_cast<unsigned long long>(seconds % 60));
  return text;
}

std::string progress_text(const ipc::KilobotStarted& started, std::uint32_t passes,
                          const ipc::KilobotProgress& progress) {
  // Endless passes: the bar shows the pass in hand.
  const std::uint32_t whole = started.frames() > 0 ? started.frames() : started.pages() + 1;
  const std::uint32_t part = started.frames() > 0 ? progress.frames_sent() : progress.page();
  const std::uint32_t filled = whole == 0 ? 0 : std::min(kBarWidth, part * kBarWidth / whole);
  std::string text = "[" + std::string(filled, '#') + std::string(kBarWidth - filled, '-') + "] ";
  if (progress.pass() == 0) {
    text += "robots are being prepared";
  } else {
    text += "pass " + std::to_string(progress.pass());
    if (passes > 0) text += " of " + std::to_string(passes);
    text += ", page " + std::to_string(progress.page()) + " of " + std::to_string(started.pages());
  }
  return text + ", " + minutes_text(progress.left_ms()) +
         (started.frames() > 0 ? " left" : " left of this pass");
}

void ProgressDisplay::show(const ipc::KilobotProgress& progress) {
  const std::string text = progress_text(started_, passes_, progress);
  if (is_terminal_) {
    std::fprintf(stderr, "\r\033[K%s", text.c_str());
    is_line_open_ = true;
  } else if (progress.pass() != pass_) {
    pass_ = progress.pass();
    std::fprintf(stderr, "%s\n", text.c_str());
  }
}

void ProgressDisplay::end_line() {
  if (is_line_open_) std::fputc('\n', stderr);
  is_line_open_ = false;
}

}  // namespace swarmtalk::cli
