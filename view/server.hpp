// Server: listens on one port and hands each connection to a Connection. Bounded: so many viewers
// are let in, and some more connections wait, so that who finds no place is told so with a
// sentence. Beyond that the one that has waited longest makes place for a newcomer. Those are
// counted. On the io_context's thread.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <string>
#include <utility>

#include "view/access.hpp"
#include "view/stage.hpp"

namespace swarmtalk::view {

class Server {
 public:
  static constexpr std::size_t kMostViewers = 128;
  static constexpr std::size_t kMostConnections = kMostViewers + 16;

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
    waiting_.push_back(connection);
  }
  /// Whether one more may be let in; else it is counted, and told on stderr once a second at most.
  bool has_place_for_viewer();
  /// What a viewer is told that finds no place, one sentence.
  static std::string no_place_text();
  /// It is a viewer now, and keeps its place.
  void connection_is_let_in(const void* connection) { waiting_.remove(connection); }
  /// Its end is under way, and its place the first that is given to another.
  void connection_leaves(const void* connection) { waiting_.push_front(connection); }
  /// A viewer sent one, and is closed. Counted, and told on stderr once a second at most.
  void tell_message_too_long(std::size_t most_bytes);
  void connection_ended(const void* connection) {
    connections_.erase(connection);
    waiting_.remove(connection);
  }

 private:
  void accept();
  void make_place();
  void tell_turned_away(std::size_t number, const char* what);
  void take(boost::asio::ip::tcp::socket socket);

  AccessRules rules_;
  Stage& stage_;
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer pause_;
  bool is_local_only_ = true;
  std::map<const void*, std::function<void()>> connections_;  // how each is closed
  std::list<const void*> waiting_;  // those that are not let in, the oldest first
  std::uint64_t turned_away_ = 0;
  std::uint64_t too_long_ = 0;
  Time told_turned_away_at_{};
  Time told_too_long_at_{};
};

}  // namespace swarmtalk::view
