// Why the daemon cannot read a file that its operator named, and the command that changes it. The
// daemon is seldom the operator: its unit sees no home and has a /tmp of its own, and a daemon that
// root starts by hand keeps the user root without what root may.
#pragma once

#include <sys/types.h>

#include <istream>
#include <string>
#include <vector>

#include "daemon/config/config.hpp"

namespace swarmtalk::daemon {

/// "user swarmtalk"; "root without capabilities", where modes count for root as for everybody.
std::string reader();

/// The folder of `path` that this process has for itself, as ProtectHome= and PrivateTmp= of a unit
/// make it: what others put there is not seen here, nor the other way round. Empty: none.
std::string hidden_folder(const std::string& path);
/// @param mounts  as /proc/self/mountinfo
std::string hidden_folder(const std::string& path, std::istream& mounts);

/// That nobody sees what the daemon makes at `path`, with the remedy. Empty: it is seen.
std::string unseen(const std::string& path);

enum class FileKind { kConfiguration, kKey };

/// "cannot be read by user swarmtalk: Permission denied; run: ..." @param error  an errno
std::string unreadable(const std::string& path, int error, FileKind kind);

/// What this daemon will not be able to do with the rights that it has now, one line each.
/// @param file  with the configuration
/// @param made_socket  that it has made itself; empty: none
std::vector<std::string> later_troubles(const Config& config, const std::string& file,
                                        const std::string& made_socket);

/// The command after which this process, and nobody else, can read the key file at `path`, which
/// belongs to `owner`.
std::string own_key_command(const std::string& path, uid_t owner);

}  // namespace swarmtalk::daemon
