#include "view/server.hpp"

#include <chrono>
#include <cstdio>
#include <stdexcept>
#include <utility>

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
                             "; take another with --port");
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

void Server::take(tcp::socket socket) {
  if (connections_.size() < kMostConnections) return serve(std::move(socket), *this);
  ++turned_away_;  // and the socket is closed here
  const Time now = Clock::now();
  if (now - told_at_ < std::chrono::seconds(1)) return;
  told_at_ = now;
  std::fprintf(stderr,
               "swarmtalk-view: %zu connections are open, the most there may be; %llu were turned "
               "away so far: close some pages\n",
               connections_.size(), static_cast<unsigned long long>(turned_away_));
}

}  // namespace swarmtalk::view
