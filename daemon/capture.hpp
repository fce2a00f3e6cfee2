// Capture: tells its listeners of every frame that the links receive or send, and why what a frame
// carried was dropped. Costs nothing while nobody listens.
#pragma once

#include <memory>
#include <vector>

#include "daemon/hub.hpp"
#include "ipc/ipc.pb.h"

namespace swarmtalk::daemon {

/// A client that asked for a capture.
class CaptureListener {
 public:
  virtual ~CaptureListener() = default;
  /// @param captured  filled but for `missed`; valid during the call only
  virtual void on_captured(ipc::Captured& captured) = 0;
};

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
