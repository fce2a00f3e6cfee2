#include "cli/doctor/fix.hpp"

#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "nl80211/radio.hpp"

namespace swarmtalk::cli::doctor {
namespace {

constexpr std::uint32_t kMulticastRate100kbps = 60;  // the lowest of OFDM

std::string outcome(int error) {
  if (error == 0) return {};
  std::string text = std::strerror(error);
  if (error == EPERM || error == EACCES) text += "; try again with sudo";
  if (error == EOPNOTSUPP) text = "the driver cannot do this";
  return text;
}

/// An interface's request for ioctl(2).
std::string change(const std::string& name, unsigned long command, bool (*edit)(int, ifreq&)) {
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket < 0) return outcome(errno);
  ifreq request{};
  std::memcpy(request.ifr_name, name.c_str(), std::min<std::size_t>(name.size(), IFNAMSIZ - 1));
  const bool is_done = edit(socket, request) && ioctl(socket, command, &request) == 0;
  const int error = errno;
  ::close(socket);
  return is_done ? std::string() : outcome(error);
}

std::string switch_on(const std::string& name) {
  return change(name, SIOCSIFFLAGS, [](int socket, ifreq& request) {
    if (ioctl(socket, SIOCGIFFLAGS, &request) != 0) return false;
    request.ifr_flags = static_cast<short>(request.ifr_flags | IFF_UP);
    return true;
  });
}

std::string set_usual_mtu(const std::string& name) {
  return change(name, SIOCSIFMTU, [](int, ifreq& request) {
    request.ifr_mtu = static_cast<int>(kUsualMtuBytes);
    return true;
  });
}

void add_radio_fix(const InterfaceFacts& interface, const Expected& expected, nl80211::Asker& asker,
                   Finding& finding) {
  const unsigned index = interface.index;
  const nl80211::Mode mode = interface.radio->interface.mode;
  const bool is_own_rate = mode == nl80211::Mode::kAdHoc || mode == nl80211::Mode::kMesh;
  if (finding.id == "power-save") {
    finding.fix = [&asker, index] { return outcome(nl80211::switch_power_save_off(asker, index)); };
    finding.fix_text = "power save is off now, until the next start";
  } else if (finding.id == "multicast-rate" && is_own_rate) {
    finding.fix = [&asker, index] {
      return outcome(nl80211::set_multicast_rate(asker, index, kMulticastRate100kbps));
    };
    finding.fix_text =
        "broadcasts leave at 6 Mb/s now, until the next start; write air_rate_mbps = 6 into the "
        "configuration of the link, since the kernel does not tell the rate";
  } else if (finding.id == "regulatory-domain" && !expected.country.empty()) {
    finding.fix = [&asker, &expected] {
      return outcome(nl80211::request_country(asker, expected.country));
    };
    finding.fix_text = "asked the kernel for country " + expected.country;
  }
}

}  // namespace

void add_fixes(const Facts& facts, const Expected& expected,
               const std::function<std::string()>& reload, nl80211::Asker* asker, Report& report) {
  for (Finding& finding : report.findings) {
    const std::string name = finding.subject;
    if (finding.id == "interface-down") {
      finding.fix = [name] { return switch_on(name); };
      finding.fix_text = name + " is switched on now";
    } else if (finding.id == "mtu-small" && finding.severity != Severity::kNote) {
      finding.fix = [name] { return set_usual_mtu(name); };
      finding.fix_text = "the MTU of " + name + " is 1500 now";
    } else if (finding.id == "configuration-changed") {
      finding.fix = reload;
      finding.fix_text = "the daemon has read its configuration again";
    }
    for (const InterfaceFacts& each : facts.interfaces) {
      if (asker != nullptr && each.name == name && each.radio) {
        add_radio_fix(each, expected, *asker, finding);
      }
    }
  }
}

}  // namespace swarmtalk::cli::doctor
