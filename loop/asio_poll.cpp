#include "loop/asio_poll.hpp"

#include <sys/eventfd.h>

#include <boost/asio/posix/stream_descriptor.hpp>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

namespace swarmtalk::loop {
namespace {

constexpr const char* kDescriptors = "/proc/self/fdinfo";

/// Whether the kernel says of a descriptor of ours that it is an epoll which watches `watched`: a
/// line "tfd: N ..." for each that it does (proc(5)).
bool is_epoll_of(const std::filesystem::path& info, int watched) {
  std::ifstream lines(info);
  for (std::string word; lines >> word;) {
    if (int number = -1; word == "tfd:" && lines >> number && number == watched) return true;
  }
  return false;
}

}  // namespace

int poll_descriptor(boost::asio::io_context& io) {
  boost::asio::posix::stream_descriptor mark(io, eventfd(0, EFD_CLOEXEC));
  std::error_code error;
  for (std::filesystem::directory_iterator each(kDescriptors, error), end; !error && each != end;
       each.increment(error)) {
    if (is_epoll_of(each->path(), mark.native_handle())) {
      return std::stoi(each->path().filename().string());
    }
  }
  throw std::system_error(
      error ? error : std::make_error_code(std::errc::no_such_file_or_directory),
      "the event loop does not find its descriptors in " + std::string(kDescriptors) +
          "; is /proc mounted?");
}

}  // namespace swarmtalk::loop
