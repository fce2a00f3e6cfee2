// Server: listens on one port and hands each connection to a Connection. Bounded: beyond the limit
// a newcomer is closed at once, and counted. On the io_context's thread.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>

#include "view/access.hpp"
#include "view/stage.hpp"

namespace swarmtalk::view {

class Server {
 public:
  static constexpr std::size_t kMostConnections = 128;

  /// @param address  of an interface of this machine. @param rules  its port 0: the kernel chooses
  /// @throws std::runtime_error  one line with the remedy
  Server(boost::asio::io_context& io, const std::string& address, AccessRules rules, Stage& stage);

  const AccessRules& rules() const { return rules_; }
  Stage& stage() { return stage_; }
  bool is_local_only() const { return is_local_only_; }

  /// Accepts no more, and closes every connection: what was under way ends with an error.
  void stop();

  void connection_began(const void* connection, std::function<void()> close) {
    connections_[connection] = std::move(close);
  }
  void connection_ended(const void* connection) { connections_.erase(connection); }

 private:
  void accept();
  void take(boost::asio::ip::tcp::socket socket);

  AccessRules rules_;
  Stage& stage_;
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer pause_;
  bool is_local_only_ = true;
  std::map<const void*, std::function<void()>> connections_;  // how each is closed
  std::uint64_t turned_away_ = 0;
  Time told_at_{};
};

}  // namespace swarmtalk::view
