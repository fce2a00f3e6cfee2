#include "daemon/operator/metrics_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

#include "daemon/common/logging.hpp"

namespace swarmtalk::daemon {
namespace {

/// @return 0, or the errno
int write_whole(const std::string& path, const std::string& text) {
  const int file =
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0644);
  if (file < 0) return errno;
  fchmod(file, 0644);  // whatever the umask: node_exporter is another user
  errno = EIO;
  const bool is_whole =
      ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  const int error = is_whole ? 0 : errno;
  close(file);
  return error;
}

}  // namespace

MetricsFile::MetricsFile(boost::asio::io_context& io, std::function<std::string()> text)
    : text_(std::move(text)), timer_(io) {}

MetricsFile::~MetricsFile() {
  remove();  // a daemon that is gone has no metrics
}

void MetricsFile::configure(const MetricsConfig& config) {
  if (config.file != config_.file) remove();
  config_ = config;
  is_failing_ = false;
  timer_.cancel();
  if (config_.file.empty()) return;
  write();
  wait();
}

void MetricsFile::wait() {
  timer_.expires_after(std::chrono::seconds(config_.interval_s));
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (error) return;
    write();
    wait();
  });
}

void MetricsFile::write() {
  const std::string unfinished = config_.file + ".new";
  int error = write_whole(unfinished, text_());
  if (error == 0 && std::rename(unfinished.c_str(), config_.file.c_str()) != 0) error = errno;
  if (error == 0) {
    if (std::exchange(is_failing_, false)) {
      log_of("daemon")->info("metrics.file: {} is written again", config_.file);
    }
    return;
  }
  if (std::exchange(is_failing_, true)) return;
  log_of("daemon")->warn(
      "metrics.file: {} cannot be written: {}; under systemd the folder must be "
      "below /run/swarmtalkd, or in ReadWritePaths=",
      config_.file, std::strerror(error));
}

void MetricsFile::remove() const {
  if (!config_.file.empty()) unlink(config_.file.c_str());
}

}  // namespace swarmtalk::daemon
