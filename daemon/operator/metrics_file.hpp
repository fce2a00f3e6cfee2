// MetricsFile: writes the metrics to a file every few seconds, for node_exporter's textfile
// collector. A reader sees the old file or the new one, never half of one.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <string>

#include "daemon/config/config.hpp"
#include "loop/timer.hpp"

namespace swarmtalk::daemon {

class MetricsFile {
 public:
  /// @param text  makes the file's content
  MetricsFile(boost::asio::io_context& io, std::function<std::string()> text);
  ~MetricsFile();

  /// Begins, goes on differently, or ends. The first file is written at once.
  void configure(const MetricsConfig& config);

 private:
  void write();
  void remove() const;

  std::function<std::string()> text_;
  loop::Timer timer_;
  MetricsConfig config_;
  bool is_failing_ = false;
};

}  // namespace swarmtalk::daemon
