#include "cli/kilobot/kilobot.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>

#include "cli/common/daemon_requests.hpp"
#include "cli/kilobot/calibration_screen.hpp"
#include "cli/kilobot/hex_file.hpp"
#include "cli/kilobot/kilobot_progress.hpp"
#include "cli/text/hex.hpp"
#include "text/counted.hpp"
#include "usage/ending_signals.hpp"

namespace swarmtalk::cli {
namespace {

using std::chrono::milliseconds;

constexpr auto kKilobotAnswerTimeout = milliseconds(5000);
constexpr auto kStopTimeout = milliseconds(5000);
constexpr auto kSlice = milliseconds(200);  // a signal is noticed after so long at the latest
constexpr std::size_t kMaxHexFileBytes = std::size_t{1} << 20;
constexpr std::uint32_t kUidBits = 16;

volatile std::sig_atomic_t g_signal = 0;

void catch_signals() {
  // The second one ends us; the daemon then stops the command.
  usage::catch_ending_signals([](int number) { g_signal = number; },
                              static_cast<int>(SA_RESETHAND));
}

std::uint32_t number(const std::string& word) {
  return static_cast<std::uint32_t>(std::stoul(word));
}

/// One command on its way through the daemon.
class CommandRun {
 public:
  CommandRun(DaemonRequests& daemon, const ipc::KilobotCommand& command)
      : daemon_(daemon), command_(command) {}

  /// Sends it and waits for its end. @return exit code; what went wrong has been told
  int run();

  const ipc::KilobotStarted& started() const { return started_; }
  const ipc::KilobotEnded& ended() const { return ended_; }

 private:
  int begin();
  int follow();
  int end();
  void cancel();
  void show(const ipc::KilobotProgress& progress);

  DaemonRequests& daemon_;
  const ipc::KilobotCommand& command_;
  ipc::KilobotStarted started_;
  ipc::KilobotEnded ended_;
  ProgressDisplay display_{started_, command_.has_passes() ? command_.passes() : 6,
                           ::isatty(STDERR_FILENO) != 0};
  bool is_cancelled_ = false;
  std::chrono::steady_clock::time_point stop_deadline_{};
};

int CommandRun::run() {
  if (const int code = begin(); code != kExitOk) return code;
  return follow();
}

int CommandRun::begin() {
  ipc::Envelope request;
  *request.mutable_kilobot_command() = command_;
  if (const Status status = daemon_.send(request); !status) return fail(status);
  Status status;
  const auto answer = daemon_.wait(kKilobotAnswerTimeout, status);
  if (!status) return fail(status);
  if (!answer) return fail("swarmtalkd does not answer", kExitTimeout);
  if (answer->has_failure()) return fail(answer->failure().text());
  started_ = answer->kilobot_started();
  for (const std::string& warning : started_.warnings()) fail("warning: " + warning);
  if (command_.has_hold_ms() && started_.frames() == 0) {
    std::fprintf(stderr, "swarmtalk-cli: sending until Ctrl-C\n");
  }
  if (command_.action() == ipc::KILOBOT_PROGRAM) {
    std::fprintf(stderr, "swarmtalk-cli: sending %s, %s%s; keep the robots in the light\n",
                 text::counted(started_.pages(), "page").c_str(),
                 minutes_text(started_.duration_ms()).c_str(),
                 started_.frames() > 0 ? " in all" : " each pass, until Ctrl-C");
  }
  return kExitOk;
}

int CommandRun::follow() {
  for (;;) {
    Status status;
    const auto envelope = daemon_.wait(kSlice, status);
    if (!status) {
      display_.end_line();
      return fail(
          "swarmtalkd is gone, and what it was sending with it; it says STOP to the "
          "overhead controller when it ends in order",
          kExitNoDaemon);
    }
    if (envelope && envelope->has_kilobot_progress() &&
        envelope->kilobot_progress().operation_id() == started_.operation_id()) {
      show(envelope->kilobot_progress());
    }
    if (envelope && envelope->has_kilobot_ended() &&
        envelope->kilobot_ended().operation_id() == started_.operation_id()) {
      ended_ = envelope->kilobot_ended();
      return end();
    }
    if (g_signal != 0 && !is_cancelled_) cancel();
    if (is_cancelled_ && std::chrono::steady_clock::now() > stop_deadline_) {
      return fail("swarmtalkd does not confirm that it sent STOP", kExitSignal + g_signal);
    }
  }
}

void CommandRun::cancel() {
  is_cancelled_ = true;
  stop_deadline_ = std::chrono::steady_clock::now() + kStopTimeout;
  ipc::Envelope request;
  request.mutable_kilobot_cancel()->set_operation_id(started_.operation_id());
  (void)daemon_.send(request);  // a lost daemon is noticed by follow()
}

void CommandRun::show(const ipc::KilobotProgress& progress) {
  if (command_.action() == ipc::KILOBOT_PROGRAM && !is_cancelled_) display_.show(progress);
  if (command_.action() == ipc::KILOBOT_READ_UID && progress.has_bit() && !command_.has_bit()) {
    print("bit " + std::to_string(progress.bit()) + ": 1 if the robot turns now, 0 if it stands\n");
  }
}

int CommandRun::end() {
  display_.end_line();
  if (ended_.end() == ipc::KILOBOT_SENT) return kExitOk;
  std::string text =
      ended_.end() == ipc::KILOBOT_STOPPED
          ? "stopped" + (is_cancelled_ ? std::string() : ": " + ended_.text()) + "; STOP was sent"
          : "not sent whole: " + ended_.text();
  if (command_.action() == ipc::KILOBOT_PROGRAM) {
    text +=
        "; robots with a part of the program stay in their bootloader until the same file is "
        "sent whole";
  }
  if (command_.action() == ipc::KILOBOT_BOOTLOAD) {
    text += "; robots that heard it wait in their bootloader for a program, or for run to leave it";
  }
  if (command_.action() == ipc::KILOBOT_READ_UID || command_.action() == ipc::KILOBOT_CALIBRATE) {
    text += "; a robot that moves goes on until pause";
  }
  fail(text);
  return is_cancelled_ ? kExitSignal + g_signal : kExitFailure;
}

/// A whole number with or without a sign, as far as positions go.
std::optional<int> signed_number(const std::string& word) {
  const std::string digits = word.starts_with('-') ? word.substr(1) : word;
  if (digits.empty() || digits.size() > 6) return std::nullopt;
  if (digits.find_first_not_of("0123456789") != std::string::npos) return std::nullopt;
  return std::stoi(word);
}

std::string add_positions(KilobotArguments& arguments) {
  for (const std::string& robot : arguments.positions) {
    std::vector<int> numbers;
    std::istringstream words(robot);
    for (std::string word; std::getline(words, word, ',');) {
      const auto each = signed_number(word);
      if (!each) break;
      numbers.push_back(*each);
    }
    // The daemon knows which numbers fit.
    const bool is_whole = numbers.size() == 4 && robot.back() != ',' &&
                          std::count(robot.begin(), robot.end(), ',') == 3 && numbers[0] >= 0;
    if (!is_whole)
      return "ROBOT is ID,X,Y,THETA in whole numbers, as in 7,120,-45,90, not " + robot;
    ipc::KilobotPosition& position = *arguments.command.add_positions();
    position.set_id(static_cast<std::uint32_t>(numbers[0]));
    position.set_x(numbers[1]);
    position.set_y(numbers[2]);
    position.set_theta(numbers[3]);
  }
  return "";
}

/// Fills in what only some commands have. @return a problem, or ""
std::string complete(KilobotArguments& arguments) {
  ipc::KilobotCommand& command = arguments.command;
  if (!arguments.link.empty()) command.set_link(arguments.link);
  if (!arguments.uid.empty()) command.set_uid(number(arguments.uid));
  if (!arguments.left.empty()) command.set_left(number(arguments.left));
  if (!arguments.right.empty()) command.set_right(number(arguments.right));
  if (arguments.saves) command.set_save(true);
  if (arguments.stops) command.set_stop(true);
  if (arguments.is_forced) command.set_force(true);
  if (arguments.may_sleep) command.set_asleep(true);
  if (!arguments.hold_s.empty()) {
    command.set_hold_ms(static_cast<std::uint32_t>(std::lround(std::stod(arguments.hold_s) * 1e3)));
  }
  if (command.action() == ipc::KILOBOT_POSITION) return add_positions(arguments);
  if (command.action() != ipc::KILOBOT_SEND) return "";
  const std::string& type = arguments.message_type;
  const bool is_number = !type.empty() && type.size() <= 3 &&
                         type.find_first_not_of("0123456789") == std::string::npos;
  if (!is_number) return "TYPE is 0 to 127, not " + type;
  const auto data = from_hex(arguments.data_hex);
  if (!data) return "HEX is pairs of hexadecimal digits, as in 01:02:ff";
  command.set_message_type(number(type));
  command.set_data(*data);
  if (arguments.checksum.empty()) return "";
  const auto checksum = from_hex(arguments.checksum);
  if (!checksum || checksum->size() != 2) {
    return "--checksum is four hexadecimal digits, as in 0xa718, not " + arguments.checksum;
  }
  command.set_checksum(static_cast<std::uint8_t>((*checksum)[0]) * 256u +
                       static_cast<std::uint8_t>((*checksum)[1]));
  return "";
}

std::string load_program(KilobotArguments& arguments) {
  errno = 0;
  std::ifstream stream(arguments.hex_path, std::ios::binary);
  std::string text(kMaxHexFileBytes + 1, '\0');
  if (stream) stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  const std::string problem = errno != 0 ? std::strerror(errno) : "cannot be read";
  if (!stream.is_open() || stream.bad() || (stream.gcount() == 0 && errno != 0)) {
    return arguments.hex_path + ": " + problem;
  }
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.size() > kMaxHexFileBytes) {
    return arguments.hex_path + ": is larger than 1 MiB; this is not a program for a Kilobot";
  }
  const HexImage image = parse_hex_file(text);
  if (!image.problem.empty()) return arguments.hex_path + ": " + image.problem;
  const std::string why = arguments.is_forced ? "" : why_no_kilobot_program(image.bytes);
  if (!why.empty()) return arguments.hex_path + ": " + why + "; --force sends it all the same";
  arguments.command.set_image(image.bytes.data(), image.bytes.size());
  arguments.command.set_passes(arguments.passes);
  return "";
}

std::string sent_text(const ipc::KilobotCommand& command, const ipc::KilobotEnded& ended,
                      const std::string& name) {
  if (command.action() == ipc::KILOBOT_PROGRAM) {
    return "sent " + text::counted(ended.passes_sent(), "pass", "passes") +
           "; robots that have all pages start the program by themselves and wait for run";
  }
  if (command.action() == ipc::KILOBOT_LED) {
    return "sent led: the overhead controller's LED toggles, unless it is sending";
  }
  if (command.action() == ipc::KILOBOT_BOOTLOAD) {
    return "sent bootload; robots that flash blue wait for a program; any other message, also of a "
           "running robot nearby, starts their old one";
  }
  return "sent " + name;
}

/// Bit by bit, with a person who looks.
int read_uid(DaemonRequests& daemon, ipc::KilobotCommand command) {
  std::uint32_t uid = 0;
  int code = kExitOk;
  for (std::uint32_t bit = 0; bit < kUidBits && code == kExitOk && g_signal == 0; ++bit) {
    command.set_bit(bit);
    CommandRun run(daemon, command);
    code = run.run();
    if (code != kExitOk) break;
    for (bool is_answered = false; !is_answered && g_signal == 0;) {
      print("bit " + std::to_string(bit) + ": does the robot turn? [y/n] ");
      std::fflush(stdout);
      char line[64] = {};
      if (std::fgets(line, sizeof line, stdin) == nullptr) {
        code = g_signal != 0 ? kExitSignal + g_signal : kExitFailure;
        break;
      }
      is_answered = line[0] == 'y' || line[0] == 'n' || line[0] == '1' || line[0] == '0';
      if (line[0] == 'y' || line[0] == '1') uid |= 1u << bit;
    }
    if (code != kExitOk) break;
  }
  const int caught = g_signal;
  g_signal = 0;
  ipc::KilobotCommand pause;  // a robot that turns goes on turning
  pause.set_action(ipc::KILOBOT_PAUSE);
  if (command.has_link()) pause.set_link(command.link());
  const int paused = CommandRun(daemon, pause).run();
  if (paused == kExitOk && (caught != 0 || code != kExitOk)) {
    print("\n");  // behind the question
    fail("the uid is not known; pause was sent");
  }
  if (caught != 0) return kExitSignal + caught;
  if (code != kExitOk) return code;
  print("uid " + std::to_string(uid) + "\n");
  return paused;
}

}  // namespace

int kilobot(const Common& common, KilobotArguments& arguments) {
  if (const std::string problem = complete(arguments); !problem.empty()) {
    return fail(problem, kExitUsage);
  }
  ipc::KilobotCommand& command = arguments.command;
  if (command.action() == ipc::KILOBOT_PROGRAM) {
    if (const std::string problem = load_program(arguments); !problem.empty()) return fail(problem);
  }
  catch_signals();
  DaemonRequests daemon;
  if (const Status status = daemon.connect(common.socket_path); !status) return fail(status);
  if (arguments.is_on_screen) return calibrate_on_screen(daemon, arguments.link, g_signal);
  if (command.action() == ipc::KILOBOT_READ_UID && ::isatty(STDIN_FILENO) != 0) {
    return read_uid(daemon, command);
  }
  CommandRun run(daemon, command);
  if (const int code = run.run(); code != kExitOk) return code;
  return print(sent_text(command, run.ended(), arguments.name) + "\n");
}

}  // namespace swarmtalk::cli
