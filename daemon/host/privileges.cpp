#include "daemon/host/privileges.hpp"

#include <cap-ng.h>
#include <sys/prctl.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>

namespace swarmtalk::daemon {
namespace {

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error("cannot drop privileges: " + what +
                           "; refusing to run with more rights than needed");
}

void verify(bool bounding_set_must_be_empty) {
  if (prctl(PR_GET_NO_NEW_PRIVS, 0, 0, 0, 0) != 1) fail("no_new_privs is not set");
  capng_clear(CAPNG_SELECT_ALL);
  if (capng_get_caps_process() != 0) fail("the kernel does not tell the capabilities");
  const auto must_be_empty = [](capng_select_t set, const char* name) {
    if (capng_have_capabilities(set) > CAPNG_NONE) fail(std::string(name) + " is not empty");
  };
  must_be_empty(CAPNG_SELECT_CAPS, "the set of effective, permitted or inheritable capabilities");
  must_be_empty(CAPNG_SELECT_AMBIENT, "the ambient set");
  if (bounding_set_must_be_empty) must_be_empty(CAPNG_SELECT_BOUNDS, "the bounding set");
}

}  // namespace

void drop_privileges() {
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) fail(std::strerror(errno));
  if (capng_get_caps_process() != 0) fail("the kernel does not tell the capabilities");
  const bool can_empty_bounding_set = capng_have_capability(CAPNG_EFFECTIVE, CAP_SETPCAP) == 1;
  capng_clear(CAPNG_SELECT_ALL);
  if (can_empty_bounding_set && capng_apply(CAPNG_SELECT_BOUNDS) != 0) {
    fail("the bounding set cannot be emptied");
  }
  if (capng_apply(CAPNG_SELECT_AMBIENT) != 0) fail("the ambient set cannot be emptied");
  if (capng_apply(CAPNG_SELECT_CAPS) != 0) fail("the capabilities cannot be given up");
  verify(can_empty_bounding_set);
}

void forbid_dumps() {
  prctl(PR_SET_DUMPABLE, 0, 0, 0, 0);
}

}  // namespace swarmtalk::daemon
