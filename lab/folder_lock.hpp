// Lock on the folder of a lab: held by the `up` or `run` that makes the lab, with its helpers, and
// then by the keeper of that. So nobody makes a lab of a name while the last one is made or taken
// down.
#pragma once

#include <optional>
#include <string>

namespace swarmtalk::lab {

class FolderLock {
 public:
  /// Does not wait. @return nothing when there is no such folder or another process has the lock
  static std::optional<FolderLock> try_take(const std::string& lab_name);

  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&& other) noexcept;
  ~FolderLock();

  /// False once the folder has been removed, also where there is another of its name.
  bool is_of_folder() const;

  int fd() const { return fd_; }

 private:
  FolderLock(std::string lab_name, int fd);

  std::string lab_name_;
  int fd_ = -1;  // a fork has the lock, too; a program that is executed has not
};

}  // namespace swarmtalk::lab
