#include "view/server.hpp"

#include <chrono>
#include <cstdio>
#include <stdexcept>
#include <utility>

#include "text/counted.hpp"
#include "view/connection.hpp"

namespace swarmtalk::view {
namespace {

using boost::asio::ip::tcp;

constexpr auto kPauseWithoutDescriptors = std::chrono::milliseconds(100);

tcp::endpoint endpoint_of(const std::string& address, std::uint16_t port) {
  boost::system::error_code error;
  const auto parsed = boost::asio::ip::make_address(address, error);
  if (error) {
    throw std::runtime_error(
        "--listen takes an address of this machine, such as 127.0.0.1 or "
        "0.0.0.0, not " +
        address);
  }
  return {parsed, port};
}

/// Once a second at most.
bool is_time_to_tell(Time& told_at) {
  const Time now = Clock::now();
  if (now - told_at < std::chrono::seconds(1)) return false;
  told_at = now;
  return true;
}

}  // namespace

Server::Server(boost::asio::io_context& io, const std::string& address, AccessRules rules,
               Stage& stage)
    : rules_(std::move(rules)), stage_(stage), acceptor_(io), pause_(io) {
  const tcp::endpoint endpoint = endpoint_of(address, rules_.port);
  is_local_only_ = endpoint.address().is_loopback();
  try {
    acceptor_.open(endpoint.protocol());
    acceptor_.set_option(tcp::acceptor::reuse_address(true));
    acceptor_.bind(endpoint);
    acceptor_.listen();
  } catch (const boost::system::system_error& error) {
    throw std::runtime_error("cannot listen on " + address + " port " +
                             std::to_string(rules_.port) + ": " + error.code().message() +
                             (error.code().value() == EADDRNOTAVAIL
                                  ? "; --listen takes an address of this machine"
                                  : "; take another with --port"));
  }
  rules_.port = acceptor_.local_endpoint().port();
  accept();
}

void Server::stop() {
  boost::system::error_code ignored;
  acceptor_.close(ignored);
  pause_.cancel();
  for (const auto& [connection, close] : connections_) close();
}

void Server::accept() {
  acceptor_.async_accept([this](const boost::system::error_code& error, tcp::socket socket) {
    if (error == boost::asio::error::operation_aborted) return;
    if (!error) {
      take(std::move(socket));
      return accept();
    }
    pause_.expires_after(kPauseWithoutDescriptors);  // out of descriptors: some will be free
    pause_.async_wait([this](const boost::system::error_code& stopped) {
      if (!stopped) accept();
    });
  });
}

bool Server::has_place_for_viewer() {
  if (connections_.size() - waiting_.size() < kMostViewers) return true;
  tell_turned_away(kMostViewers, "viewers look");
  return false;
}

std::string Server::no_place_text() {
  return std::to_string(kMostViewers) +
         " viewers look already, the most there may be: close some pages";
}

// A request comes within moments; who sends none may wait only where there is room. As many wait as
// there are places more than viewers, at least.
void Server::make_place() {
  if (connections_.size() < kMostConnections || waiting_.empty()) return;
  tell_turned_away(kMostConnections, "connections are open");
  const auto oldest = connections_.find(waiting_.front());
  const std::function<void()> close = std::move(oldest->second);
  waiting_.pop_front();
  connections_.erase(oldest);
  close();
}

void Server::take(tcp::socket socket) {
  make_place();
  serve(std::move(socket), *this);
}

void Server::tell_turned_away(std::size_t number, const char* what) {
  ++turned_away_;
  if (!is_time_to_tell(told_turned_away_at_)) return;
  std::fprintf(stderr,
               "swarmtalk-view: %zu %s, the most there may be; %s turned away so far: close some "
               "pages\n",
               number, what, text::counted(turned_away_, "was", "were").c_str());
}

void Server::tell_message_too_long(std::size_t most_bytes) {
  ++too_long_;
  if (!is_time_to_tell(told_too_long_at_)) return;
  std::fprintf(
      stderr,
      "swarmtalk-view: a viewer sent a message of more than %zu bytes and was closed; %llu "
      "so far\n",
      most_bytes, static_cast<unsigned long long>(too_long_));
}

}  // namespace swarmtalk::view
