// Stage: all who look, and what they are shown. Makes each turn's state once for all of them. On
// the io_context's thread.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <memory>
#include <set>
#include <string_view>

#include "view/viewer.hpp"

namespace swarmtalk::view {

class Stage {
 public:
  /// @param may_operate  whether viewers may send messages
  Stage(boost::asio::io_context& io, Source& source, bool may_operate);

  /// @param subprotocol  that was agreed on; empty: our page
  std::unique_ptr<Viewer> make_viewer(std::string_view subprotocol);

  void add(Viewer& viewer);
  void remove(Viewer& viewer);
  std::size_t viewers() const { return viewers_.size(); }

 private:
  void wait_turn();
  void turn();

  Source& source_;
  bool may_operate_;
  boost::asio::steady_timer timer_;
  std::set<Viewer*> viewers_;
  unsigned turns_ = 0;
  bool is_waiting_ = false;
};

}  // namespace swarmtalk::view
