// PageViewer: the conversation with our own page. It is told states and events as JSON, and asks
// for little: which channel's messages it wants, whose card is open, and, where allowed, to send.
#pragma once

#include <optional>
#include <string>

#include "view/viewer.hpp"

namespace swarmtalk::view {

class PageViewer final : public Viewer {
 public:
  static constexpr unsigned kMostBadRequests = 16;  // then the connection is closed

  PageViewer(Source& source, bool may_operate) : source_(source), may_operate_(may_operate) {}
  PageViewer(const PageViewer&) = delete;
  PageViewer& operator=(const PageViewer&) = delete;
  ~PageViewer() override { unwatch(); }

  void begin() override;
  void on_text(std::string_view text) override;
  void on_binary(std::string_view bytes) override;
  void show(const Scene& scene) override;
  void on_message(const HeardMessage& message) override;
  void on_line(const LogLine& line) override;
  void on_jump() override;

 private:
  std::string answer(std::string_view text);
  std::string watch(const std::string& channel);
  void unwatch();
  void tell_lines();
  void tell_recent_messages();
  void tell(std::string json);
  void refuse(const std::string& why);

  Source& source_;
  bool may_operate_;
  std::optional<std::string> opened_;     // channel whose messages are shown
  std::optional<std::uint16_t> watched_;  // its number, once it is known
  std::uint32_t card_ = 0;                // robot whose card is open; 0: none
  std::uint64_t told_dropped_ = 0;
  unsigned bad_requests_ = 0;
};

}  // namespace swarmtalk::view
