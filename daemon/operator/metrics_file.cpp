#include "daemon/operator/metrics_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string_view>
#include <utility>

#include "daemon/common/logging.hpp"
#include "daemon/config/file_access.hpp"

namespace swarmtalk::daemon {
namespace {

/// @return 0, or the errno
int write_whole(int file, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(file, text.data(), text.size());
    if (written < 0 && errno != EINTR) return errno;  // also of the rest that a full disk leaves
    if (written > 0) text.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

/// Waits for nobody, whatever somebody has put there. @return empty: done; else why not
std::string replace(const std::string& path, const std::string& text) {
  constexpr int kFlags = O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY;
  const int file = ::open(path.c_str(), kFlags, 0644);
  if (file < 0) return errno == ENXIO ? "something else is there" : std::strerror(errno);
  struct stat status {};
  std::string problem;
  if (fstat(file, &status) != 0) {
    problem = std::strerror(errno);
  } else if (!S_ISREG(status.st_mode)) {
    problem = "something else than a file is there";
  } else {
    fchmod(file, 0644);  // whatever the umask: node_exporter is another user
    int error = ftruncate(file, 0) == 0 ? 0 : errno;
    if (error == 0) error = write_whole(file, text);
    if (error != 0) problem = std::strerror(error);
  }
  close(file);
  return problem;
}

}  // namespace

MetricsFile::MetricsFile(boost::asio::io_context& io, std::function<std::string()> text)
    : text_(std::move(text)), timer_(io, [this] { write(); }) {}

MetricsFile::~MetricsFile() {
  remove();  // a daemon that is gone has no metrics
}

void MetricsFile::configure(const MetricsConfig& config) {
  if (config.file != config_.file) {
    remove();
    const std::string problem = unseen(config.file);
    if (!problem.empty()) log_of("daemon")->warn("metrics.file: {}", problem);
  }
  config_ = config;
  is_failing_ = false;
  timer_.cancel();
  if (config_.file.empty()) return;
  write();
}

void MetricsFile::write() {
  timer_.after(std::chrono::seconds(config_.interval_s));
  const std::string unfinished = config_.file + ".new";
  std::string problem = replace(unfinished, text_());
  if (!problem.empty()) {
    problem = unfinished + ": " + problem;
  } else if (std::rename(unfinished.c_str(), config_.file.c_str()) != 0) {
    problem = std::strerror(errno);
  }
  if (problem.empty()) {
    if (std::exchange(is_failing_, false)) {
      log_of("daemon")->info("metrics.file: {} is written again", config_.file);
    }
    return;
  }
  if (std::exchange(is_failing_, true)) return;
  log_of("daemon")->warn(
      "metrics.file: {} cannot be written by {}: {}; choose a folder that it may write to (of "
      "swarmtalkd.service: /run/swarmtalkd, and what ReadWritePaths= names)",
      config_.file, reader(), problem);
}

void MetricsFile::remove() const {
  if (!config_.file.empty()) unlink(config_.file.c_str());
}

}  // namespace swarmtalk::daemon
