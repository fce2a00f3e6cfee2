#include "daemon/operator/capture.hpp"

#include <algorithm>
#include <chrono>
#include <string>

#include "daemon/operator/counter_list.hpp"
#include "drivers/link/frame_tap.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::daemon {
namespace {

std::uint64_t wall_clock_ns() {
  const auto now = loop::wall_now().time_since_epoch();
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::nanoseconds>(now).count());
}

}  // namespace

// Why a frame was dropped is what it made link and node count: that holds for causes yet unknown.
class Capture::Tap final : public drivers::FrameTap {
 public:
  Tap(Capture& capture, Station& station)
      : capture_(capture),
        station_(station),
        link_(dynamic_cast<drivers::Tappable*>(&station.link())) {
    if (link_ != nullptr) link_->set_tap(this);
    before_ = counters();
  }
  ~Tap() override {
    if (link_ != nullptr) link_->set_tap(nullptr);
  }

  void before_received() override {
    // What the kernel has dropped meanwhile is told with the frame that comes after it.
    drivers::Counters now = counters();
    for (std::size_t i = 0; i < now.size() && i < before_.size(); ++i) {
      if (now[i].first == "kernel_drops") now[i].second = before_[i].second;
    }
    before_ = std::move(now);
  }

  void received(std::span<const std::uint8_t> datagram, std::size_t header_bytes) override {
    captured_.Clear();
    captured_.set_ethernet_header(datagram.data(), header_bytes);
    const auto frame = datagram.subspan(header_bytes);
    captured_.set_frame(frame.data(), frame.size());
    drivers::Counters now = counters();
    for (std::size_t i = 0; i < now.size() && i < before_.size(); ++i) {
      if (now[i].second == before_[i].second || !tells_a_drop(now[i].first)) continue;
      ipc::Counter& cause = *captured_.add_dropped();
      cause.set_name(std::string(now[i].first));
      cause.set_value(now[i].second - before_[i].second);
    }
    before_ = std::move(now);
    tell();
  }

  void sent(std::span<const std::uint8_t> frame) override {
    captured_.Clear();
    captured_.set_frame(frame.data(), frame.size());
    captured_.set_sent(true);
    tell();
  }

 private:
  drivers::Counters counters() const {
    drivers::Counters all = station_.link().counters();
    const drivers::Counters node = station_.counters();
    all.insert(all.end(), node.begin(), node.end());
    return all;
  }
  void tell() {
    captured_.set_link(station_.name());
    captured_.set_time_ns(wall_clock_ns());
    capture_.tell(captured_);
  }

  Capture& capture_;
  Station& station_;
  drivers::Tappable* link_;
  drivers::Counters before_;
  ipc::Captured captured_;
};

Capture::Capture(const Hub& hub) : hub_(hub) {}

Capture::~Capture() = default;

void Capture::add(CaptureListener& listener) {
  listeners_.push_back(&listener);
  if (!taps_.empty()) return;
  for (Station* station : hub_.stations()) taps_.push_back(std::make_unique<Tap>(*this, *station));
}

void Capture::remove(CaptureListener& listener) {
  std::erase(listeners_, &listener);
  if (listeners_.empty()) taps_.clear();
}

void Capture::tell(ipc::Captured& captured) {
  for (CaptureListener* listener : listeners_) listener->on_captured(captured);
}

}  // namespace swarmtalk::daemon
