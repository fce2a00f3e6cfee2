#include "cli/kilobot/calibration_screen.hpp"

#include <poll.h>
#include <unistd.h>

#include <chrono>

#include "cli/common/commands.hpp"
#include "cli/common/deadline.hpp"
#include "cli/kilobot/calibration.hpp"
#include "cli/look/screen.hpp"

namespace swarmtalk::cli {
namespace {

constexpr auto kKeySlice = std::chrono::milliseconds(40);      // a key waits no longer
constexpr auto kQuitTimeout = std::chrono::seconds(15);        // for what is left to be sent
constexpr auto kFirstAnswerTimeout = std::chrono::seconds(5);  // for the daemon's first word

class CalibrationScreen {
 public:
  CalibrationScreen(DaemonRequests& daemon, const std::string& link,
                    const volatile std::sig_atomic_t& signal)
      : daemon_(daemon), link_(link), signal_(signal) {}

  int run() {
    const std::string problem =
        screen_.open("calibrate", "calibrate left, right and straight send one duty each");
    if (!problem.empty()) return fail(problem);
    while (status_ && failure_.empty() && !has_ended()) {
      screen_.draw(calibration_.lines(link_, screen_.width()));
      step();
      look_for_an_end();
    }
    screen_.close();
    if (!status_) {
      fail(status_);
      return fail("a robot that moves goes on until pause", kExitNoDaemon);
    }
    if (!failure_.empty()) return fail(failure_);
    if (const int code = print(calibration_.summary() + "\n"); code != kExitOk) return code;
    return signal_ == 0 ? kExitOk : kExitSignal + signal_;
  }

 private:
  bool has_ended() const {
    return calibration_.is_ending() && !is_sending_ && !calibration_.has_next();
  }

  void step() {
    if (!is_sending_ && calibration_.has_next()) send();
    if (const auto envelope = daemon_.wait(kKeySlice, status_)) take(*envelope);
    if (is_sending_ && operation_id_ == 0 && Clock::now() > answer_by_) {
      failure_ = "swarmtalkd does not answer";
    }
    for (int key = screen_.key(); key != Screen::kNoKey; key = screen_.key()) {
      calibration_.press(key);
    }
  }

  void send() {
    ipc::Envelope request;
    *request.mutable_kilobot_command() = calibration_.take_next();
    if (!link_.empty()) request.mutable_kilobot_command()->set_link(link_);
    is_sending_ = true;
    operation_id_ = 0;
    answer_by_ = Clock::now() + kFirstAnswerTimeout;
    status_ = daemon_.send(request);
  }

  void take(const ipc::Envelope& envelope) {
    if (envelope.has_kilobot_started()) {
      operation_id_ = envelope.kilobot_started().operation_id();
    } else if (envelope.has_failure()) {
      is_sending_ = false;
      calibration_.on_failed(envelope.failure().text());
      if (calibration_.is_ending()) failure_ = "pause was not sent: " + envelope.failure().text();
    } else if (envelope.has_kilobot_ended() &&
               envelope.kilobot_ended().operation_id() == operation_id_) {
      is_sending_ = false;
      if (envelope.kilobot_ended().end() == ipc::KILOBOT_SENT) return calibration_.on_sent();
      calibration_.on_failed("not sent whole: " + envelope.kilobot_ended().text());
      if (calibration_.is_ending()) {
        failure_ = "pause was not sent: " + envelope.kilobot_ended().text();
      }
    }
  }

  void look_for_an_end() {
    pollfd terminal{STDIN_FILENO, POLLIN, 0};
    const bool is_gone = ::poll(&terminal, 1, 0) > 0 && (terminal.revents & (POLLHUP | POLLERR));
    if ((signal_ != 0 || is_gone) && !calibration_.is_ending()) calibration_.quit();
    if (!calibration_.is_ending()) return;
    if (end_by_ == Clock::time_point{}) end_by_ = Clock::now() + kQuitTimeout;
    if (Clock::now() > end_by_) failure_ = "swarmtalkd does not confirm that it sent pause";
  }

  DaemonRequests& daemon_;
  const std::string& link_;
  const volatile std::sig_atomic_t& signal_;
  Screen screen_;
  Calibration calibration_;
  Status status_;
  std::string failure_;
  bool is_sending_ = false;
  std::uint32_t operation_id_ = 0;  // of what is being sent; 0: not answered yet
  Clock::time_point answer_by_{};
  Clock::time_point end_by_{};
};

}  // namespace

int calibrate_on_screen(DaemonRequests& daemon, const std::string& link,
                        const volatile std::sig_atomic_t& signal) {
  return CalibrationScreen(daemon, link, signal).run();
}

}  // namespace swarmtalk::cli
