#include "cli/doctor/diagnose.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>

namespace swarmtalk::cli::doctor {
namespace {

/// A counter of a link that rises means others are on the air whom nobody here hears.
struct Stranger {
  const char* counter;
  const char* id;
  const char* what;
  const char* remedy;
  bool is_here = false;  // its command is for this robot's daemon
};

constexpr std::array<Stranger, 12> kStrangers{{
    {"frames_other_key", "other-key", "frames come that are sealed with another swarm key",
     "give all robots one key_file, then `swarmtalk-cli reload` on each"},
    {"frames_without_key", "other-key", "frames come without a seal, and this link has a swarm key",
     "give the other robots the key_file too, then `swarmtalk-cli reload` there"},
    {"frames_sealed", "other-key", "frames come that are sealed, and this link has no swarm key",
     "set key_file of this link, then `swarmtalk-cli reload`", true},
    {"frames_not_authentic", "not-authentic", "frames come that are damaged or made up",
     "look who sends them: `swarmtalk-cli capture FILE`, then Wireshark; all robots need one "
     "release",
     true},
    {"frames_not_fresh", "not-fresh", "sealed frames come that were recorded or held back",
     "somebody repeats frames, or a robot has check_freshness = false: remove that line there, "
     "or set it on all"},
    {"frames_replayed", "not-fresh", "sealed frames come a second time",
     "somebody repeats frames: look with `swarmtalk-cli capture FILE`", true},
    {"frames_too_old", "not-fresh", "sealed frames come too late",
     "something holds frames back: try `swarmtalk-cli doctor --peer ROBOT`", true},
    {"frames_other_profile", "other-profile", "frames come whose packets are of another profile",
     "set the same profile for this link on all robots, then restart swarmtalkd"},
    {"frames_other_version", "other-version", "frames come of another version of the air frame",
     "install one release on all robots"},
    {"frames_unknown_flags", "other-version", "frames come with flags of a newer release",
     "install one release on all robots"},
    {"frames_not_ours", "ethertype-shared", "frames come under our EtherType that are not ours",
     "somebody else uses this EtherType: set another `ethertype` on all robots"},
    {"frames_tagged", "vlan-differs", "frames come that are tagged for another VLAN",
     "bring all robots into one VLAN at the switch or access point, or set `interface` to this "
     "VLAN's"},
}};

// Of broadcasts, which are never repeated: among many robots on one Wi-Fi up to 0.3 are lost. A
// robot's loss is a finding above 0.5, and only if it is 3 standard deviations above the usual.
constexpr double kUsualNeighbourLoss = 0.3;
constexpr double kMostNeighbourLoss = 0.5;

std::uint64_t rise_of(const LinkFacts& link, const char* counter) {
  const auto found = link.rises.find(counter);
  return found == link.rises.end() ? 0 : found->second;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

void diagnose_configuration(const DaemonFacts& daemon, Report& report) {
  const std::string file = daemon.config_file.empty() ? "the configuration" : daemon.config_file;
  if (daemon.config_error) {
    // What this daemon may not read, `--check` of somebody else reads.
    const bool is_unread = daemon.config_error->find(" cannot be read") != std::string::npos;
    const bool is_running = daemon.state == DaemonFacts::State::kRuns;
    const std::string remedy =
        !is_unread
            ? "correct the line; `swarmtalkd --check --config " + file + "` says when it is right"
        : is_running ? "do what the line says, then `" + daemon.words.cli + " reload`"
                     : "do what the line says, then " + daemon.words.restart;
    const bool is_named = daemon.config_error->starts_with(file + ": ");
    report.add({"configuration-wrong", Severity::kError, file,
                daemon.config_error->substr(is_named ? file.size() + 2 : 0), remedy});
    return;
  }
  if (!daemon.is_config_compared) return;
  report.looked_at.push_back("configuration");
  if (!daemon.config_reload.empty()) {
    report.add({"configuration-changed", Severity::kWarning, file,
                "is not what the daemon runs with: " + joined(daemon.config_reload) + " changed",
                daemon.words.cli + " reload"});
  }
  if (!daemon.config_restart.empty()) {
    report.add({"configuration-needs-restart", Severity::kWarning, file,
                "is not what the daemon runs with: " + joined(daemon.config_restart) + " changed",
                daemon.words.restart});
  }
}

constexpr const char* kOtherId =
    "on one of the two, change what its id is from (`swarmtalk-cli status` there says: its host's "
    "name, its address or node.id), then `swarmtalk-cli reload` there; one that was set by "
    "`swarmtalk-cli node-id` is set to another by the same command";

void diagnose_ids(const DaemonFacts& daemon, Report& report) {
  if (daemon.id_trouble) {
    report.add({"node-id-missing", Severity::kWarning, "robot " + std::to_string(daemon.node_id),
                "keeps its node id, but would not start again: " + *daemon.id_trouble,
                "do what the line says; `swarmtalkd --check --config " + daemon.config_file +
                    "` says when this machine has an id again"});
  }
  const auto namesake = std::find_if(daemon.neighbours.begin(), daemon.neighbours.end(),
                                     [&](const NeighbourFacts& each) {
                                       return each.is_duplicate && each.node_id == daemon.node_id;
                                     });
  const bool is_heard = namesake != daemon.neighbours.end();
  if ((daemon.id_collisions > 0 || is_heard) && daemon.is_id_fixed) {
    report.add({"node-id-collision", Severity::kError, "robot " + std::to_string(daemon.node_id),
                "another robot" + (is_heard ? " (" + namesake->address + ")" : "") +
                    " has this node id too; here it is " + daemon.node_id_source,
                kOtherId});
  }
  std::vector<std::uint32_t> told;
  for (const NeighbourFacts& each : daemon.neighbours) {
    const bool is_told = std::find(told.begin(), told.end(), each.node_id) != told.end();
    if (!each.is_duplicate || is_told || each.node_id == daemon.node_id) continue;
    told.push_back(each.node_id);
    std::string addresses;
    for (const NeighbourFacts& other : daemon.neighbours) {
      if (other.node_id != each.node_id || !other.is_duplicate) continue;
      addresses += (addresses.empty() ? "" : " and ") + other.address;
    }
    report.add({"node-id-collision", Severity::kError, "robot " + std::to_string(each.node_id),
                "two robots have this node id: " + addresses, kOtherId});
  }
}

}  // namespace

const char* name_of(Severity severity) {
  switch (severity) {
    case Severity::kError:
      return "error";
    case Severity::kWarning:
      return "warning";
    case Severity::kNote:
      break;
  }
  return "note";
}

bool Report::has_findings() const {
  return std::any_of(findings.begin(), findings.end(),
                     [](const Finding& each) { return each.severity != Severity::kNote; });
}

std::string address_text(std::uint64_t address) {
  std::array<char, 18> text{};
  std::snprintf(
      text.data(), text.size(), "%02x:%02x:%02x:%02x:%02x:%02x",
      static_cast<unsigned>(address >> 40 & 0xFF), static_cast<unsigned>(address >> 32 & 0xFF),
      static_cast<unsigned>(address >> 24 & 0xFF), static_cast<unsigned>(address >> 16 & 0xFF),
      static_cast<unsigned>(address >> 8 & 0xFF), static_cast<unsigned>(address & 0xFF));
  return text.data();
}

void diagnose_daemon(const Facts& facts, Report& report) {
  const DaemonFacts& daemon = facts.daemon;
  using State = DaemonFacts::State;
  if (daemon.state == State::kNoPermission) {
    const std::size_t remedy = daemon.trouble.find("; ");
    report.add({"socket-permission", Severity::kError, "socket", daemon.trouble.substr(0, remedy),
                remedy == std::string::npos ? "" : daemon.trouble.substr(remedy + 2)});
    return;
  }
  if (daemon.state != State::kRuns) {
    const char* id = daemon.state == State::kAbsent ? "daemon-absent"
                     : daemon.state == State::kDead ? "daemon-dead"
                                                    : "daemon-silent";
    const bool has_remedy = daemon.state == State::kAbsent || daemon.state == State::kDead;
    const std::size_t end = has_remedy ? daemon.trouble.find("; ") : std::string::npos;
    const bool is_beside_lab = daemon.trouble.find("; a lab is up") != std::string::npos;
    report.add({id, Severity::kError, "swarmtalkd", daemon.trouble.substr(0, end),
                is_beside_lab
                    ? daemon.trouble.substr(end + 2)
                    : daemon.words.start + "; " + daemon.words.log + " says why it ended"});
    diagnose_configuration(daemon, report);
    return;
  }
  report.looked_at.push_back("daemon");
  if (daemon.version != facts.cli_version) {
    report.add(
        {"version-differs", Severity::kWarning, "swarmtalkd",
         "the daemon is version " + daemon.version + ", and swarmtalk-cli is " + facts.cli_version,
         "install both of one release, then " + daemon.words.restart});
  }
  diagnose_configuration(daemon, report);
  diagnose_ids(daemon, report);
}

void diagnose_link(const LinkFacts& link, const DaemonFacts& daemon, Report& report) {
  const std::string subject = "link " + link.name;
  if (link.asked_buffer_bytes && link.given_buffer_bytes < *link.asked_buffer_bytes) {
    const std::string asked = std::to_string(*link.asked_buffer_bytes);
    report.add({"receive-buffer", Severity::kWarning, subject,
                "the kernel gives " + std::to_string(link.given_buffer_bytes) +
                    " bytes of receive buffer, not the " + asked + " of receive_buffer_bytes",
                "sudo sysctl -w net.core.rmem_max=" + asked +
                    ", for good in a file of /etc/sysctl.d, then restart swarmtalkd"});
  }
  if (const std::uint64_t drops = rise_of(link, "kernel_drops"); drops > 0) {
    report.add({"kernel-drops", Severity::kWarning, subject,
                "the kernel has just dropped " + std::to_string(drops) +
                    " frames because the receive buffer was full",
                "raise receive_buffer_bytes and net.core.rmem_max, or send less"});
  }
  if (const std::uint64_t errors = rise_of(link, "send_errors"); errors > 0 && link.is_up) {
    report.add({"send-errors", Severity::kWarning, subject,
                "the interface has just refused " + std::to_string(errors) + " frames",
                "look into `journalctl -k` for the driver of " + link.interface});
  }
  std::vector<std::string> told;
  for (const Stranger& each : kStrangers) {
    if (rise_of(link, each.counter) == 0) continue;
    if (std::find(told.begin(), told.end(), each.id) != told.end()) continue;
    told.push_back(each.id);
    std::string remedy = each.remedy;
    constexpr std::string_view kCli = "swarmtalk-cli";
    if (each.is_here) remedy.replace(remedy.find(kCli), kCli.size(), daemon.words.cli);
    report.add({each.id, Severity::kError, subject,
                std::string(each.what) + " (" + each.counter + ")", remedy});
  }
  const bool is_heard = std::any_of(daemon.neighbours.begin(), daemon.neighbours.end(),
                                    [&](const auto& each) { return each.link == link.name; });
  if (link.is_up && !is_heard && told.empty() && (link.type == "raw_l2" || link.type == "udp")) {
    report.add({"nobody-heard", Severity::kNote, subject, "no robot was heard within the last 10 s",
                "if there are others: swarmtalk-cli doctor --peer ROBOT; a robot whose programs "
                "send nothing is heard only with beacon_ms"});
  }
}

// An interface that is not where doctor looks: gone, renamed, or in the daemon's own namespace.
bool diagnose_absent(const std::string& name, const LinkFacts* link, const DaemonWords& words,
                     Report& report) {
  const auto says = [&](const char* part) { return link->state.find(part) != std::string::npos; };
  if (link == nullptr || says("is gone") || says("waiting for interface")) {
    report.add({"interface-missing", link != nullptr ? Severity::kError : Severity::kNote, name,
                "there is no such interface",
                "`ip link` lists those there are; " +
                    (link == nullptr ? std::string("plug the radio in, or name another")
                                     : "plug the radio in; or correct `interface` in [links." +
                                           link->name + "], then " + words.restart)});
    return true;
  }
  const bool is_renamed = says("(renamed to '");
  if (is_renamed) {
    report.add({"interface-renamed", Severity::kWarning, name,
                "the interface has another name now: link " + link->name + " is " + link->state,
                "write the name that it has now into `interface` in [links." + link->name +
                    "]: with the old one the link will not come up at the next start"});
  }
  report.not_looked_at.push_back(
      {"interface " + name, is_renamed
                                ? "it has another name now"
                                : "it is in the daemon's network namespace: run doctor in that"});
  return link->is_up;
}

bool diagnose_interface(const InterfaceFacts& interface, const LinkFacts* link,
                        const DaemonWords& words, Report& report) {
  const std::string& name = interface.name;
  const Severity severity = link != nullptr ? Severity::kError : Severity::kNote;
  if (interface.index == 0) return diagnose_absent(name, link, words, report);
  report.looked_at.push_back("interface " + name);
  if (interface.block != RadioBlock::kNone) {
    const bool is_soft = interface.block == RadioBlock::kSoft;
    report.add({"radio-blocked", severity, name,
                is_soft ? "the radio is blocked by rfkill"
                        : "the radio is blocked by a switch of this machine",
                (is_soft ? "sudo rfkill unblock wifi" : "turn that switch on") +
                    (", then sudo ip link set " + name + " up") +
                    (is_soft ? "; on a Raspberry Pi first set your country: sudo raspi-config "
                               "nonint do_wifi_country CC"
                             : "")});
    return true;
  }
  if (!interface.is_switched_on) {
    report.add({"interface-down", severity, name, "the interface is switched off",
                "sudo ip link set " + name + " up"});
    return true;
  }
  if (!interface.bridge.empty()) {
    report.add({"bridge-port", severity, name,
                "the interface is a port of " + interface.bridge + ", which takes all its frames",
                "set interface = \"" + interface.bridge + "\"" +
                    (link != nullptr ? " in [links." + link->name + "]" : "") + ", then " +
                    words.restart});
    return true;
  }
  const bool is_too_small = link != nullptr && link->packet_limit_bytes > 0 &&
                            link->packet_limit_bytes < link->packet_bytes;
  if (is_too_small) {
    report.add({"mtu-small", Severity::kWarning, name,
                "its MTU is " + std::to_string(interface.mtu_bytes) + " bytes, so packets end at " +
                    std::to_string(link->packet_limit_bytes) + " of " +
                    std::to_string(link->packet_bytes) + " and longer ones of others are lost",
                "sudo ip link set " + name + " mtu 1500"});
  } else if (link != nullptr && link->type == "raw_l2" && interface.mtu_bytes < kUsualMtuBytes) {
    report.add({"mtu-small", Severity::kNote, name,
                "its MTU is " + std::to_string(interface.mtu_bytes) +
                    " bytes, and robots with 1500 send frames that it drops",
                "unless all robots have this MTU: sudo ip link set " + name + " mtu 1500"});
  }
  if (!interface.has_carrier && !interface.is_radio) {
    report.add({"no-carrier", severity, name, "the interface has no carrier", "plug its cable in"});
    return true;
  }
  if (interface.is_dormant) {
    const bool is_dropped = interface.is_radio || link == nullptr;
    report.add({"not-authorised", is_dropped ? severity : Severity::kWarning, name,
                "the interface is dormant: no supplicant has authorised it",
                "look at wpa_supplicant; without one: sudo ip link set " + name +
                    " mode default state up"});
    return interface.is_radio;
  }
  const bool needs_address = link != nullptr && link->type == "udp" && !interface.is_loopback;
  if (needs_address && interface.has_carrier && !interface.has_ipv4_address) {
    report.add({"no-address", link->is_up ? Severity::kWarning : Severity::kError, name,
                link->is_up
                    ? "the interface has no IPv4 address, so the datagrams of link " + link->name +
                          " leave from another interface's"
                    : "the interface has no IPv4 address, which link " + link->name + " needs",
                "look at its DHCP client, or sudo ip address add 10.83.84.N/24 dev " + name +
                    " with another N on each robot"});
    return !link->is_up;
  }
  return false;
}

const NeighbourFacts* double_of(const Facts& facts, const LinkFacts& link) {
  for (const InterfaceFacts& interface : facts.interfaces) {
    if (interface.name != link.interface || interface.index == 0) continue;
    std::uint64_t own = 0;
    for (const std::uint8_t byte : interface.mac) own = own << 8 | byte;
    for (const NeighbourFacts& each : facts.daemon.neighbours) {
      if (each.link != link.name || each.is_ghost) continue;
      if (each.address == address_text(own)) return &each;
    }
  }
  return nullptr;
}

void diagnose_address(const Facts& facts, const LinkFacts& link, Report& report) {
  const NeighbourFacts* const other = double_of(facts, link);
  if (other == nullptr) return;
  const std::string& name = link.interface;
  report.add({"address-twice", Severity::kError, name,
              "robot " + std::to_string(other->node_id) +
                  " has this interface's hardware address too: " + other->address,
              "on one of the two: sudo ip link set " + name + " down; sudo ip link set " + name +
                  " address 02:00:00:00:00:NN, with another NN on each robot; sudo ip link set " +
                  name +
                  " up. For good, take the fixed address out of what was copied to it "
                  "(NetworkManager: cloned-mac-address)"});
}

void diagnose_serial_device(const SerialFacts& device, Report& report) {
  if (!device.others.empty()) {
    report.add(
        {"device-shared", Severity::kError, device.path,
         "it is open in another program too, and what that reads is lost here: " + device.others,
         "end that program, `sudo kill PID`; a service that comes back (ModemManager, "
         "serial-getty) is kept away as docs/kilobot.md says"});
  } else if (device.are_all) {
    report.looked_at.push_back(device.path);
  } else {
    report.not_looked_at.push_back({"other programs that have " + device.path + " open",
                                    "only root sees them: sudo swarmtalk-cli doctor"});
  }
}

void diagnose_losses(const Facts& facts, const LinkFacts& link, Report& report) {
  if (rise_of(link, "kernel_drops") > 0) return;  // explained
  std::string robots;
  std::string first;
  for (const NeighbourFacts& each : facts.daemon.neighbours) {
    if (each.link != link.name || each.loss_frames == 0) continue;
    const double deviation =
        std::sqrt(kUsualNeighbourLoss * (1 - kUsualNeighbourLoss) / each.loss_frames);
    if (each.loss < std::max(kMostNeighbourLoss, kUsualNeighbourLoss + 3 * deviation)) continue;
    const std::string robot = std::to_string(each.node_id);
    robots += (robots.empty() ? "" : ", ") + ("robot " + robot) + " " +
              std::to_string(std::lround(100 * each.loss)) + " %";
    if (first.empty()) first = robot;
  }
  if (robots.empty()) return;
  std::string mtu;
  for (const InterfaceFacts& each : facts.interfaces) {
    if (each.name == link.interface) mtu = " (" + std::to_string(each.mtu_bytes) + " here)";
  }
  report.add({"neighbour-lossy", Severity::kWarning, "link " + link.name,
              "frames were lost in the last seconds: of " + robots,
              "try `swarmtalk-cli doctor --peer " + first +
                  "`; look whether all robots have one MTU" + mtu +
                  ", who else fills the air (`swarmtalk-cli top`), distance and antennas"});
}

void diagnose(const Facts& facts, const Expected& expected, Report& report) {
  diagnose_daemon(facts, report);
  std::vector<std::string> explained;
  for (const InterfaceFacts& interface : facts.interfaces) {
    const LinkFacts* link = nullptr;
    for (const LinkFacts& each : facts.daemon.links) {
      if (each.interface == interface.name) link = &each;
    }
    const bool is_explained =
        diagnose_interface(interface, link, facts.daemon.words, report) ||
        (interface.is_switched_on && diagnose_radio(interface, link, expected, report));
    if (is_explained) explained.push_back(interface.name);
  }
  const bool is_running = facts.daemon.state == DaemonFacts::State::kRuns;
  if (is_running && facts.daemon.links.empty()) {
    report.add({"link-down", Severity::kError, "swarmtalkd", "the daemon has no link",
                "add a [links.NAME] section to the configuration"});
  }
  for (const LinkFacts& link : facts.daemon.links) {
    report.looked_at.push_back("link " + link.name);
    const bool is_explained =
        std::find(explained.begin(), explained.end(), link.interface) != explained.end();
    if (!link.is_up && !is_explained) {
      report.add({"link-down", Severity::kError, "link " + link.name, link.state,
                  "do what the line says; " + facts.daemon.words.log + " has more"});
    }
    diagnose_address(facts, link, report);
    diagnose_link(link, facts.daemon, report);
    diagnose_losses(facts, link, report);
  }
  for (const SerialFacts& each : facts.serial_devices) diagnose_serial_device(each, report);
  if (!facts.clock) {
    report.not_looked_at.push_back({"clock", "the kernel does not tell"});
  } else if (!facts.clock->is_synchronised) {
    report.add({"clock-not-synchronised", Severity::kNote, "clock",
                "the clock is not synchronised: SwarmTalk does not need it, but the times of "
                "recordings and logs of several robots do not fit together",
                "sudo apt install systemd-timesyncd, or chrony where there is no internet"});
  } else {
    report.looked_at.push_back("clock");
  }
}

}  // namespace swarmtalk::cli::doctor
