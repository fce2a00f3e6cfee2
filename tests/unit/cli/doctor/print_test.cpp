// What `swarmtalk-cli doctor` prints for people: the result first, and nothing wider than the
// terminal.
#include <gtest/gtest.h>

#include <sstream>

#include "cli/doctor/print.hpp"

namespace swarmtalk::cli::doctor {
namespace {

Finding finding(Severity severity, const std::string& id) {
  Finding finding;
  finding.severity = severity;
  finding.id = id;
  finding.subject = "wlan0";
  finding.what = "what is wrong with it";
  finding.remedy = "do this";
  return finding;
}

TEST(DoctorPrint, ARobotWithoutFindingsIsWellInTheFirstLine) {
  Report report;
  report.looked_at = {"daemon", "clock"};
  EXPECT_EQ(to_text(report, {}, {}), "all is well\n\nok: daemon\nok: clock\n");
  report.findings = {finding(Severity::kNote, "clock-free")};
  EXPECT_EQ(to_text(report, {}, {}),
            "all is well\n\n"
            "note: wlan0: what is wrong with it [clock-free]\n    do this\n"
            "ok: daemon\nok: clock\n");
}

TEST(DoctorPrint, FindingsAreCountedFirstThenErrorsBeforeWarnings) {
  Report report;
  report.looked_at = {"daemon", "clock"};
  report.findings = {finding(Severity::kWarning, "a"), finding(Severity::kError, "b"),
                     finding(Severity::kWarning, "c")};
  EXPECT_EQ(to_text(report, {}, {}),
            "1 error, 2 warnings\n\n"
            "error: wlan0: what is wrong with it [b]\n    do this\n"
            "warning: wlan0: what is wrong with it [a]\n    do this\n"
            "warning: wlan0: what is wrong with it [c]\n    do this\n"
            "looked at: daemon, clock\n");
}

TEST(DoctorPrint, WhatCouldNotBeLookedAtIsNotCalledWell) {
  Report report;
  report.not_looked_at = {{"radio", "no right to"}};
  EXPECT_EQ(to_text(report, {}, {}),
            "no finding, but not everything could be looked at\n\n"
            "not looked at: radio\n    no right to\n");
}

TEST(DoctorPrint, NoLineIsWiderThanTheTerminal) {
  Report report;
  report.findings = {finding(Severity::kError, "a")};
  report.findings[0].what =
      "a long sentence of many words that goes on and on and does not end yet";
  report.findings[0].remedy =
      "and what to do about it, which is as long, and has a command: ip link";
  report.not_looked_at = {{"the radio of this interface", "a reason with rather many words in it"}};
  Look look;
  look.columns = 40;
  std::istringstream lines(to_text(report, {}, look));
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 40u) << line;
}

}  // namespace
}  // namespace swarmtalk::cli::doctor
