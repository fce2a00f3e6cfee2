// FoxgloveViewer: the conversation with Lichtblick or Foxglove, in the protocol that both its names
// (foxglove.websocket.v1, foxglove.sdk.v1) mean: channels are advertised, a client subscribes to
// some, and messages go out in protobuf. It only looks.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "view/viewer.hpp"

namespace swarmtalk::view {

class FoxgloveViewer final : public Viewer {
 public:
  static constexpr std::size_t kMostSubscriptions = SendQueue::kStates - 1;
  static constexpr unsigned kMostBadRequests = 16;  // then the connection is closed

  explicit FoxgloveViewer(Source& source) : source_(source) {}

  void begin() override;
  void on_text(std::string_view text) override;
  void on_binary(std::string_view bytes) override;
  void show(const Scene& scene) override;
  void on_message(const HeardMessage&) override {}
  void on_line(const LogLine& line) override;
  void on_jump() override;
  bool wants_pictures() const override;

 private:
  struct Subscription {
    std::uint32_t id = 0;  // the client's
    std::size_t topic = 0;
  };

  std::string answer(std::string_view text);
  std::string subscribe(std::uint64_t id, std::uint64_t channel);
  void refuse(const std::string& why);
  void tell(std::string json);
  void tell_left_out();
  void tell_line(std::uint32_t subscription, const LogLine& line);

  Source& source_;
  std::array<std::optional<Subscription>, kMostSubscriptions> subscriptions_;
  std::uint64_t told_dropped_ = 0;
  LeftOut told_left_out_;
  unsigned bad_requests_ = 0;
};

}  // namespace swarmtalk::view
