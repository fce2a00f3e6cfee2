#include "client_lib/entrance.hpp"

#include "client_lib/hints.hpp"

namespace swarmtalk::client {

Status Entrance::refuse(const Turn::Stay& stay) {
  const Status status(StatusCode::kBadArgument,
                      stay.is_refused() ? "a Client was called while another thread is inside it, "
                                          "in process(), run() or a call that waits; one thread "
                                          "owns a Client, others may call send() and stop()"
                                        : "process() and run() cannot be called inside a callback; "
                                          "return from it instead");
  reports_.add(status);
  on_report_();
  return status;
}

Status Entrance::refuse_child() {
  Status status(StatusCode::kBadArgument,
                "this Client belongs to the parent process; make one after the fork");
  if (!has_told_child_.exchange(true)) print_hint(std::string(status.text()));
  return status;
}

void Entrance::report_two_callers() {
  reports_.add(Status(StatusCode::kBadArgument,
                      "process() or run() is called by two threads in turn, so callbacks run in "
                      "both; one thread owns a Client, others may call send() and stop()"));
}

}  // namespace swarmtalk::client
