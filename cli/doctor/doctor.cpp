#include "cli/doctor/doctor.hpp"

#include <algorithm>
#include <fstream>
#include <iostream>
#include <iterator>

#include "cli/common/operator.hpp"
#include "cli/doctor/diagnose.hpp"
#include "cli/doctor/fix.hpp"
#include "cli/doctor/look.hpp"
#include "cli/doctor/print.hpp"

namespace swarmtalk::cli::doctor {
namespace {

/// Interfaces of the daemon's links, the one that the user names, and without a daemon all radios.
std::vector<std::string> interfaces_of(const DaemonFacts& daemon, const std::string& named) {
  std::vector<std::string> names;
  const auto add = [&names](const std::string& name) {
    if (!name.empty() && std::find(names.begin(), names.end(), name) == names.end()) {
      names.push_back(name);
    }
  };
  for (const LinkFacts& each : daemon.links) add(each.interface);
  add(named);
  if (names.empty()) {
    for (const std::string& each : radios()) add(each);
  }
  return names;
}

/// What the other robot's doctor has printed. @return kBadArgument: it cannot be read
Status read_peer_report(const std::string& file, std::uint32_t own_node, PeerFacts& peer) {
  std::string text;
  if (file == "-") {
    text.assign(std::istreambuf_iterator<char>(std::cin), {});
  } else {
    std::ifstream stream(file, std::ios::binary);
    if (!stream) return Status(StatusCode::kBadArgument, "cannot read " + file);
    text.assign(std::istreambuf_iterator<char>(stream), {});
  }
  std::string problem;
  peer.report = read_report(text, own_node, problem);
  if (peer.report) return Status();
  return Status(StatusCode::kBadArgument, (file == "-" ? "standard input" : file) + " " + problem);
}

std::string reload_daemon(const Common& common) {
  OperatorConnection daemon;
  if (const Status status = daemon.open(common.socket_path); !status) {
    return std::string(status.text());
  }
  ipc::Envelope question;
  ipc::Envelope answer;
  question.mutable_reload();
  const Status status = daemon.request(question, answer);
  return status ? std::string() : std::string(status.text());
}

std::vector<Fixed> fix_all(const Report& report) {
  std::vector<Fixed> fixes(report.findings.size());
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (!report.findings[i].fix) continue;
    fixes[i].is_tried = true;
    fixes[i].failure = report.findings[i].fix();
  }
  return fixes;
}

bool are_all_fixed(const Report& report, const std::vector<Fixed>& fixes) {
  for (std::size_t i = 0; i < report.findings.size(); ++i) {
    if (report.findings[i].severity == Severity::kNote) continue;
    if (i >= fixes.size() || !fixes[i].is_tried || !fixes[i].failure.empty()) return false;
  }
  return true;
}

}  // namespace

int doctor(const Common& common, const DoctorArguments& arguments) {
  interrupt_on_signals();
  nl80211::KernelAsker kernel;
  nl80211::KernelAsker* asker = kernel.is_there() ? &kernel : nullptr;
  Facts facts;
  facts.cli_version = SWARMTALK_VERSION;
  facts.seconds = arguments.seconds;
  facts.daemon = look_at_daemon(common, arguments.seconds, arguments.config_file);
  for (const std::string& name : interfaces_of(facts.daemon, arguments.interface)) {
    facts.interfaces.push_back(look_at_interface(name, asker));
  }
  facts.serial_devices = look_at_serial_devices(facts.daemon);
  facts.clock = look_at_clock();
  Report report;
  diagnose(facts, arguments.expected, report);
  PeerFacts peer;
  const bool has_daemon = facts.daemon.state == DaemonFacts::State::kRuns;
  const bool is_tested = arguments.peer.robot != 0 && has_daemon && caught_signal() == 0;
  if (arguments.peer.robot == facts.daemon.node_id && is_tested) {
    return fail("robot " + std::to_string(arguments.peer.robot) + " is this one; name another",
                kExitUsage);
  }
  if (is_tested) {
    if (!arguments.peer.report_file.empty()) {
      const std::string& file = arguments.peer.report_file;
      const Status status = read_peer_report(file, facts.daemon.node_id, peer);
      if (!status) return fail(status);
    }
    if (const Status status = test_peer(common, arguments.peer, peer); !status) {
      return fail(status);
    }
    diagnose_peer(peer, facts, report);
  } else if (arguments.peer.robot != 0) {
    report.not_looked_at.push_back({"robot " + std::to_string(arguments.peer.robot),
                                    "the daemon of this robot does not answer"});
  }
  if (caught_signal() != 0) return kExitSignal + caught_signal();
  add_fixes(
      facts, arguments.expected, [&common] { return reload_daemon(common); }, asker, report);
  std::vector<Fixed> fixes;
  if (arguments.has_fix) fixes = fix_all(report);
  const int written = print(
      common.is_json ? json_text(to_json(report, fixes, facts, is_tested ? &peer : nullptr)) + "\n"
                     : to_text(report, fixes, look_of_output()));
  if (written != kExitOk) return written;
  if (report.has_findings() && !are_all_fixed(report, fixes)) return kExitFailure;
  return report.not_looked_at.empty() ? kExitOk : kExitUsage;
}

}  // namespace swarmtalk::cli::doctor
