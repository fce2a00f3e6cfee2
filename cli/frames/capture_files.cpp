#include "cli/frames/capture_files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace swarmtalk::cli {

CaptureWriter::~CaptureWriter() {
  if (!new_path_.empty()) ::unlink(new_path_.c_str());
}

std::string CaptureWriter::open(const std::string& path, bool replaces, pcap_t* format) {
  path_ = path;
  struct stat old {};
  const bool is_there = path == "-" || ::stat(path.c_str(), &old) == 0;
  is_stream_ = path == "-" || (is_there && !S_ISREG(old.st_mode));
  int fd = -1;
  if (path == "-") {
    fd = ::dup(STDOUT_FILENO);
  } else if (is_stream_) {
    fd = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  } else {
    if (is_there && replaces) {
      new_path_ = path + ".part";
      ::unlink(new_path_.c_str());  // of a program that was killed
    }
    const std::string& made = new_path_.empty() ? path : new_path_;
    fd = ::open(made.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  }
  if (fd < 0) {
    const int error = errno;
    const bool is_for_replace = error == EEXIST && new_path_.empty();
    const std::string what = new_path_.empty() ? path : new_path_;
    new_path_.clear();
    return "cannot make " + what + ": " + std::strerror(error) +
           (is_for_replace ? "; --replace overwrites it" : "");
  }
  std::FILE* const file = ::fdopen(fd, "w");
  if (file == nullptr) {
    ::close(fd);
    return "cannot make " + path + ": " + std::strerror(errno);
  }
  dumper_.reset(pcap_dump_fopen(format, file));  // which closes the file when it fails
  return dumper_ ? std::string() : "cannot write " + path + ": " + pcap_geterr(format);
}

// pcap_dump() keeps quiet about it.
void CaptureWriter::look_for_failure() {
  const int error = errno;
  if (error_ == 0 && std::ferror(pcap_dump_file(dumper_.get())) != 0) error_ = error;
}

void CaptureWriter::write(const pcap_pkthdr& header, std::string_view bytes) {
  pcap_dump(reinterpret_cast<u_char*>(dumper_.get()), &header,
            reinterpret_cast<const u_char*>(bytes.data()));
  look_for_failure();
}

std::string CaptureWriter::flush() {
  pcap_dump_flush(dumper_.get());
  look_for_failure();
  return error_ == 0 ? std::string() : "cannot write " + path_ + ": " + std::strerror(error_);
}

std::string CaptureWriter::take_place() {
  if (std::string problem = flush(); !problem.empty()) return problem;
  if (new_path_.empty()) return {};
  if (::rename(new_path_.c_str(), path_.c_str()) != 0) {
    return "cannot replace " + path_ + ": " + std::strerror(errno);
  }
  new_path_.clear();
  return {};
}

}  // namespace swarmtalk::cli
