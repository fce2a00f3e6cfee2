#include "daemon/operator/prometheus.hpp"

#include <cstdint>
#include <cstdio>
#include <string_view>

#include "daemon/operator/counter_list.hpp"
#include "text/plain.hpp"

namespace swarmtalk::daemon {
namespace {

/// A label's value, plain and escaped as the format wants it.
std::string in_quotes(std::string_view value) {
  return text::quoted(text::plain(value), '"');
}

class Exposition {
 public:
  void begin(const std::string& name, const char* type, std::string_view help) {
    name_ = "swarmtalk_" + name;
    text_ += "# HELP " + name_ + " " + std::string(help) + ".\n";
    text_ += "# TYPE " + name_ + " " + type + "\n";
  }
  void add(const std::string& labels, const std::string& value) {
    text_ += name_ + (labels.empty() ? "" : "{" + labels + "}") + " " + value + "\n";
  }
  void gauge(const std::string& name, std::string_view help, const std::string& value) {
    begin(name, "gauge", help);
    add("", value);
  }
  std::string take() { return std::move(text_); }

 private:
  std::string text_;
  std::string name_;
};

template <typename Counters>
const ipc::Counter* find(const Counters& counters, std::string_view name) {
  for (const ipc::Counter& counter : counters) {
    if (counter.name() == name) return &counter;
  }
  return nullptr;
}

std::string label_of(const ipc::LinkStatus& link) {
  return "link=" + in_quotes(link.name());
}

void add_gauges(const ipc::Status& status, Exposition& out) {
  out.begin("build_info", "gauge", "always 1; the version is a label");
  out.add("version=" + in_quotes(status.version()), "1");
  char uptime[32];
  std::snprintf(uptime, sizeof uptime, "%.3f", static_cast<double>(status.uptime_ms()) / 1000.0);
  out.gauge("uptime_seconds", "seconds since the daemon started", uptime);
  out.gauge("node_id", "this robot's node id", std::to_string(status.node_id()));
  out.gauge("clients", "programs connected now", std::to_string(status.clients()));
  out.gauge("channels", "channels in use", std::to_string(status.channels_size()));
  out.begin("link_up", "gauge", "1: the link is up");
  for (const ipc::LinkStatus& link : status.links()) {
    out.add(label_of(link) + ",type=" + in_quotes(link.type()) +
                ",device=" + in_quotes(link.device()) + ",profile=" + in_quotes(link.profile()),
            link.up() ? "1" : "0");
  }
}

}  // namespace

std::string prometheus_text(const ipc::Status& status) {
  Exposition out;
  add_gauges(status, out);
  for (const CounterHelp& counter : counter_list()) {
    const std::string name(counter.name);
    if (counter.owner == CounterOwner::kDaemon) {
      out.begin(name + "_total", "counter", counter.help);
      const ipc::Counter* found = find(status.counters(), counter.name);
      if (found != nullptr) out.add("", std::to_string(found->value()));
      continue;
    }
    out.begin((counter.name.starts_with("node_") ? "" : "link_") + name + "_total", "counter",
              counter.help);
    for (const ipc::LinkStatus& link : status.links()) {
      const ipc::Counter* found = find(link.counters(), counter.name);
      if (found != nullptr) out.add(label_of(link), std::to_string(found->value()));
    }
  }
  return out.take();
}

}  // namespace swarmtalk::daemon
