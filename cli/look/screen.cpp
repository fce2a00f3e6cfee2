#include "cli/look/screen.hpp"

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <clocale>

// Last: it has macros with short names.
#include <curses.h>

namespace swarmtalk::cli {
namespace {

constexpr const char* kUndrawable =
    "the terminal cannot be drawn on; set TERM to its kind, as in TERM=xterm; ";

bool is_head(const std::string& line) {
  const auto is_small = [](char letter) { return letter >= 'a' && letter <= 'z'; };
  return !line.empty() && line[0] >= 'A' && line[0] <= 'Z' &&
         std::none_of(line.begin(), line.end(), is_small);
}

}  // namespace

std::string Screen::open(const char* verb) {
  return open(verb, std::string(verb) + " --once prints it once, --json a line each period");
}

std::string Screen::open(const std::string& verb, const std::string& instead) {
  if (::isatty(STDOUT_FILENO) == 0 || ::isatty(STDIN_FILENO) == 0) {
    return verb + " draws on a terminal, and this is none; " + instead;
  }
  std::setlocale(LC_CTYPE, "");
  SCREEN* screen = ::newterm(nullptr, stdout, stdin);
  if (screen == nullptr) {
    return kUndrawable + instead;
  }
  screen_ = screen;
  if (::tigetstr("cup") == nullptr) {  // TERM=dumb: lines only, one below the other
    close();
    return kUndrawable + instead;
  }
  ::cbreak();
  ::noecho();
  ::nodelay(stdscr, TRUE);
  ::keypad(stdscr, TRUE);
  ::curs_set(0);
  return {};
}

void Screen::close() {
  if (screen_ == nullptr) return;
  ::endwin();
  ::delscreen(static_cast<SCREEN*>(screen_));
  screen_ = nullptr;
}

std::size_t Screen::width() const {
  return static_cast<std::size_t>(std::max(1, getmaxx(stdscr)));
}

std::size_t Screen::height() const {
  return static_cast<std::size_t>(std::max(1, getmaxy(stdscr)));
}

void Screen::draw(const std::vector<std::string>& lines) {
  ::erase();
  for (std::size_t i = 0; i < lines.size() && i < height(); ++i) {
    if (is_head(lines[i])) attron(A_BOLD);
    mvaddnstr(static_cast<int>(i), 0, lines[i].c_str(), -1);
    attroff(A_BOLD);
  }
  ::refresh();
}

int Screen::key() {
  const int key = ::getch();
  return key == ERR ? kNoKey : key;
}

}  // namespace swarmtalk::cli
