// Capture: tells its listeners of every frame that the links receive or send, and why what a frame
// carried was dropped. Costs nothing while nobody listens.
#pragma once

#include <memory>
#include <vector>

#include "daemon/hub/hub.hpp"
#include "daemon/session/operations.hpp"
#include "ipc/ipc.pb.h"

namespace swarmtalk::daemon {

class Capture {
 public:
  /// @param hub  whose stations are tapped; outlives this
  explicit Capture(const Hub& hub);
  ~Capture();

  /// @pre not added
  void add(CaptureListener& listener);
  /// May be called for one that is not there.
  void remove(CaptureListener& listener);

 private:
  class Tap;

  void tell(ipc::Captured& captured);

  const Hub& hub_;
  std::vector<CaptureListener*> listeners_;
  std::vector<std::unique_ptr<Tap>> taps_;  // while somebody listens
};

}  // namespace swarmtalk::daemon
