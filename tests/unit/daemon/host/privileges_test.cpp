#include "daemon/host/privileges.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <map>
#include <string>

namespace swarmtalk::daemon {
namespace {

std::map<std::string, std::string> own_status() {
  std::ifstream file("/proc/self/status");
  std::map<std::string, std::string> fields;
  for (std::string line; std::getline(file, line);) {
    const auto colon = line.find(":\t");
    if (colon != std::string::npos) fields[line.substr(0, colon)] = line.substr(colon + 2);
  }
  return fields;
}

// In a child: what is given up is given up for good.
int in_child(int (*body)()) {
  const pid_t pid = fork();
  if (pid == 0) _exit(body());
  int status = 0;
  waitpid(pid, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

int dropped_sets() {
  drop_privileges();
  const auto fields = own_status();
  const std::string none(16, '0');
  int failures = 0;
  for (const char* set : {"CapInh", "CapPrm", "CapEff", "CapAmb"})
    failures += fields.at(set) != none;
  if (geteuid() == 0) failures += fields.at("CapBnd") != none;
  failures += fields.at("NoNewPrivs") != "1";
  return failures;
}

int packet_socket_error() {
  drop_privileges();
  const int descriptor = socket(AF_PACKET, SOCK_RAW, 0);
  return descriptor < 0 ? errno : 0;
}

TEST(Privileges, NothingIsLeft) {
  EXPECT_EQ(in_child(dropped_sets), 0);
}

TEST(Privileges, NoNewPacketSocketCanBeOpened) {
  EXPECT_EQ(in_child(packet_socket_error), EPERM);
}

TEST(Privileges, DroppingTwiceIsFine) {
  EXPECT_EQ(in_child([] {
              drop_privileges();
              drop_privileges();
              return 0;
            }),
            0);
}

}  // namespace
}  // namespace swarmtalk::daemon
