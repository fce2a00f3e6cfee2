#include "daemon/host/service_manager.hpp"

#include <systemd/sd-daemon.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <utility>

#include "loop/clock.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr std::chrono::microseconds kStatusPeriod = std::chrono::seconds(5);

}  // namespace

ServiceManager::ServiceManager(boost::asio::io_context& io, std::function<std::string()> status)
    : status_(std::move(status)), timer_(io, [this] { tick(); }) {
  if (std::getenv("NOTIFY_SOCKET") == nullptr) return;
  period_ = kStatusPeriod;
  std::uint64_t watchdog_us = 0;
  if (sd_watchdog_enabled(0, &watchdog_us) > 0) {
    period_ = std::min(period_, std::chrono::microseconds(watchdog_us / 2));
  }
}

void ServiceManager::ready() {
  if (period_.count() == 0) return;
  told_ = status_();
  sd_notify(0, ("READY=1\nSTATUS=" + told_).c_str());
  timer_.after(period_);
}

void ServiceManager::reloading() {
  const auto now =
      std::chrono::duration_cast<std::chrono::microseconds>(loop::now().time_since_epoch());
  sd_notifyf(0, "RELOADING=1\nMONOTONIC_USEC=%llu", static_cast<unsigned long long>(now.count()));
}

void ServiceManager::stopping() {
  sd_notify(0, "STOPPING=1");
}

void ServiceManager::tick() {
  timer_.after(period_);
  const std::string status = status_();
  if (status == told_) {
    sd_notify(0, "WATCHDOG=1");
    return;
  }
  told_ = status;
  sd_notify(0, ("WATCHDOG=1\nSTATUS=" + told_).c_str());
}

}  // namespace swarmtalk::daemon
