#include "lab/folder_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <utility>

#include "lab/state.hpp"

namespace swarmtalk::lab {

std::optional<FolderLock> FolderLock::try_take(const std::string& lab_name) {
  FolderLock lock(lab_name, open(folder_of(lab_name).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (lock.fd_ < 0 || flock(lock.fd_, LOCK_EX | LOCK_NB) != 0 || !lock.is_of_folder()) return {};
  return lock;
}

FolderLock::FolderLock(std::string lab_name, int fd) : lab_name_(std::move(lab_name)), fd_(fd) {}

FolderLock::FolderLock(FolderLock&& other) noexcept
    : lab_name_(std::move(other.lab_name_)), fd_(std::exchange(other.fd_, -1)) {}

FolderLock& FolderLock::operator=(FolderLock&& other) noexcept {
  std::swap(lab_name_, other.lab_name_);
  std::swap(fd_, other.fd_);
  return *this;
}

FolderLock::~FolderLock() {
  if (fd_ >= 0) close(fd_);
}

bool FolderLock::is_of_folder() const {
  struct stat locked {};
  struct stat found {};
  return fstat(fd_, &locked) == 0 && stat(folder_of(lab_name_).c_str(), &found) == 0 &&
         locked.st_ino == found.st_ino && locked.st_dev == found.st_dev;
}

}  // namespace swarmtalk::lab
