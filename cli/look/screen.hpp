// Screen: a terminal that shows lines and tells keys, by ncurses. One at a time; the destructor
// gives the terminal back as it was. The program's own thread.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace swarmtalk::cli {

class Screen {
 public:
  static constexpr int kNoKey = -1;
  static constexpr int kEscape = 27;
  static constexpr int kDelete = 127;
  static constexpr int kDown = 0402;  // these as ncurses tells them
  static constexpr int kUp = 0403;
  static constexpr int kLeft = 0404;
  static constexpr int kRight = 0405;
  static constexpr int kBackspace = 0407;
  static constexpr int kPageDown = 0522;
  static constexpr int kPageUp = 0523;

  Screen() = default;
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
  ~Screen() { close(); }

  /// @return empty, or one sentence: why there is none, and what to do
  std::string open(const char* verb);
  /// @param instead  what does without a screen
  std::string open(const std::string& verb, const std::string& instead);
  void close();

  std::size_t width() const;
  std::size_t height() const;

  /// Shows these lines from the top; what does not fit is cut. Lines that begin with a capital and
  /// hold no small letter, heads of tables, are bold.
  void draw(const std::vector<std::string>& lines);

  /// The key that was pressed, kNoKey: none. Never waits. Standard input is readable when one was.
  int key();

 private:
  void* screen_ = nullptr;
};

}  // namespace swarmtalk::cli
