#include "view/connection.hpp"

#include <algorithm>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "view/page.hpp"
#include "view/server.hpp"

namespace swarmtalk::view {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;

constexpr auto kRequestTimeout = std::chrono::seconds(10);
constexpr auto kIdleTimeout = std::chrono::seconds(30);  // pings keep a living one open
constexpr std::uint32_t kMostHeaderBytes = 8192;
constexpr std::size_t kMostMessageBytes = 64 * 1024;  // from a browser
constexpr int kSendBufferBytes = 128 * 1024;          // the kernel's: what is old when it is read

using Request = http::request<http::empty_body>;
using Response = http::response<http::string_body>;

std::string_view view_of(beast::string_view text) {
  return {text.data(), text.size()};
}

Response response_to(const Request& request, http::status status, const char* type,
                     std::string body) {
  Response response{status, request.version()};
  response.set(http::field::content_type, type);
  response.set(http::field::cache_control, "no-store");
  response.set("Content-Security-Policy",
               "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
               "connect-src 'self'; img-src data:; base-uri 'none'; form-action 'none'; "
               "frame-ancestors 'none'");
  response.set("X-Frame-Options", "DENY");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  response.keep_alive(false);
  response.body() = std::move(body);
  response.prepare_payload();
  return response;
}

/// Our choice of what a client offers ("a, b"); empty: it offers none of ours.
std::string choose(std::string_view offered) {
  for (const char* ours : {"foxglove.sdk.v1", "foxglove.websocket.v1", "swarmtalk.view.v1"}) {
    http::token_list list{beast::string_view(offered.data(), offered.size())};
    if (list.exists(ours)) return ours;
  }
  return {};
}

// Keeps itself alive while an operation is under way.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(boost::asio::ip::tcp::socket socket, Server& server)
      : server_(server), stream_(std::move(socket)) {
    server_.connection_began(this, [this] { close(); });
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() {
    if (viewer_) server_.stage().remove(*viewer_);
    server_.connection_ended(this);
  }

  void read_request() {
    parser_.header_limit(kMostHeaderBytes);
    parser_.body_limit(0);
    tcp().expires_after(kRequestTimeout);
    http::async_read(tcp(), buffer_, parser_,
                     [self = shared_from_this()](beast::error_code error, std::size_t) {
                       self->on_request(error);
                     });
  }

 private:
  beast::tcp_stream& tcp() { return stream_.next_layer(); }

  void on_request(beast::error_code error) {
    if (error == http::error::end_of_stream || error == beast::error::timeout ||
        error == boost::asio::error::connection_reset ||
        error == boost::asio::error::operation_aborted) {
      return;
    }
    request_ = parser_.release();
    if (error) {
      return respond(http::status::bad_request, "text/plain",
                     "this is not an HTTP request: " + error.message() + "\n");
    }
    beast::error_code gone;
    const auto peer = tcp().socket().remote_endpoint(gone);
    if (gone) return;
    const std::string_view target = view_of(request_.target());
    Visitor visitor;
    visitor.is_this_machine = peer.address().is_loopback();
    visitor.host = view_of(request_[http::field::host]);
    if (const auto origin = request_.find(http::field::origin); origin != request_.end()) {
      visitor.origin = view_of(origin->value());
    }
    visitor.target = target;
    visitor.authorization = view_of(request_[http::field::authorization]);
    const std::string why = refusal(server_.rules(), visitor);
    if (!why.empty()) return respond(http::status::forbidden, "text/plain", why + "\n");
    if (websocket::is_upgrade(request_)) return accept_websocket();
    const std::string_view path = target.substr(0, target.find('?'));
    if (request_.method() != http::verb::get && request_.method() != http::verb::head) {
      return respond(http::status::method_not_allowed, "text/plain", "only GET is answered\n");
    }
    if (path != "/" && path != "/index.html") {
      return respond(http::status::not_found, "text/plain", "there is one page, at /\n");
    }
    if (!server_.has_place_for_viewer()) {
      return respond(http::status::service_unavailable, "text/plain",
                     Server::no_place_text() + "\n");
    }
    respond(http::status::ok, "text/html; charset=utf-8",
            request_.method() == http::verb::head ? std::string() : std::string(page()));
  }

  void respond(http::status status, const char* type, std::string body) {
    response_.emplace(response_to(request_, status, type, std::move(body)));
    tcp().expires_after(kRequestTimeout);
    http::async_write(
        tcp(), *response_, [self = shared_from_this()](beast::error_code, std::size_t) {
          beast::error_code ignored;
          self->tcp().socket().shutdown(boost::asio::socket_base::shutdown_send, ignored);
        });
  }

  void accept_websocket() {
    const std::string_view offered = view_of(request_[http::field::sec_websocket_protocol]);
    const std::string chosen = choose(offered);
    if (chosen.empty() && !offered.empty()) {
      return respond(http::status::bad_request, "text/plain",
                     "the subprotocols here are swarmtalk.view.v1, foxglove.websocket.v1 and "
                     "foxglove.sdk.v1\n");
    }
    beast::error_code ignored;
    tcp().socket().set_option(boost::asio::socket_base::send_buffer_size(kSendBufferBytes),
                              ignored);
    tcp().socket().set_option(boost::asio::ip::tcp::no_delay(true), ignored);
    tcp().expires_never();  // the WebSocket has timeouts of its own
    stream_.set_option(websocket::stream_base::timeout{kRequestTimeout, kIdleTimeout, true});
    stream_.set_option(
        websocket::stream_base::decorator([chosen](websocket::response_type& response) {
          if (!chosen.empty()) response.set(http::field::sec_websocket_protocol, chosen);
        }));
    stream_.read_message_max(0);  // on_read() holds the limit, and says so
    stream_.async_accept(request_, [self = shared_from_this(), chosen](beast::error_code error) {
      if (!error) self->begin(chosen);
    });
  }

  void begin(const std::string& subprotocol) {
    buffer_.clear();
    if (!server_.has_place_for_viewer()) return turn_away();
    viewer_ = server_.stage().make_viewer(subprotocol);
    viewer_->wake = [this] { write(); };
    viewer_->leave = [this](std::string why) { leave(std::move(why)); };
    server_.stage().add(*viewer_);
    server_.connection_is_let_in(this);
    viewer_->begin();
    read();
  }

  void read() {
    stream_.async_read_some(buffer_, kMostMessageBytes + 1 - buffer_.size(),
                            [self = shared_from_this()](beast::error_code error, std::size_t) {
                              self->on_read(error);
                            });
  }

  void on_read(beast::error_code error) {
    if (error) return close();
    if (is_leaving_) return;  // what still comes is read by the closing
    // What its frame announces counts: who waits for it would keep a place for nothing.
    const std::size_t to_come = stream_.is_message_done() ? 0 : stream_.read_size_hint(1);
    if (buffer_.size() > kMostMessageBytes || to_come > kMostMessageBytes - buffer_.size()) {
      server_.tell_message_too_long(kMostMessageBytes);
      return leave("a message may have " + std::to_string(kMostMessageBytes) + " bytes at most",
                   websocket::close_code::too_big);
    }
    if (!stream_.is_message_done()) return read();
    const auto bytes = buffer_.cdata();
    const std::string_view message(static_cast<const char*>(bytes.data()), bytes.size());
    if (stream_.got_text()) {
      viewer_->on_text(message);
    } else {
      viewer_->on_binary(message);
    }
    buffer_.consume(buffer_.size());
    if (!is_leaving_) read();
  }

  void write() {
    if (writing_ || is_leaving_) return;
    std::optional<Outgoing> next = viewer_->queue.take();
    if (!next) return;
    writing_ = std::move(next->bytes);
    stream_.binary(next->is_binary);
    stream_.async_write(boost::asio::buffer(*writing_),
                        [self = shared_from_this()](beast::error_code error, std::size_t) {
                          self->writing_.reset();
                          if (error) return self->close();
                          if (self->is_leaving_) return self->send_close();
                          self->write();
                        });
  }

  // The reason goes into the closing frame, where browsers show it.
  void leave(std::string why, websocket::close_code code = websocket::close_code::policy_error) {
    if (std::exchange(is_leaving_, true)) return;
    server_.connection_leaves(this);
    why_ = std::move(why);
    close_code_ = code;
    if (!writing_) send_close();
  }

  // A browser does not show what answers a handshake, but why it was closed.
  void turn_away() {
    is_leaving_ = true;
    why_ = Server::no_place_text();
    close_code_ = websocket::close_code::try_again_later;
    send_close();
  }

  void send_close() {
    if (std::exchange(is_close_sent_, true)) return;
    why_.resize(std::min<std::size_t>(why_.size(), 120));  // a closing frame holds no more
    const websocket::close_reason reason(close_code_, why_);
    stream_.async_close(reason, [self = shared_from_this()](beast::error_code) {});
  }

  void close() {
    if (viewer_) server_.stage().remove(*viewer_);
    beast::error_code ignored;
    tcp().socket().close(ignored);
  }

  Server& server_;
  websocket::stream<beast::tcp_stream, false> stream_;
  beast::flat_buffer buffer_{kMostMessageBytes + kMostHeaderBytes};
  http::request_parser<http::empty_body> parser_;
  Request request_;
  std::optional<Response> response_;
  std::unique_ptr<Viewer> viewer_;
  std::shared_ptr<const std::string> writing_;
  std::string why_;
  websocket::close_code close_code_ = websocket::close_code::policy_error;
  bool is_leaving_ = false;
  bool is_close_sent_ = false;
};

}  // namespace

void serve(boost::asio::ip::tcp::socket socket, Server& server) {
  std::make_shared<Connection>(std::move(socket), server)->read_request();
}

}  // namespace swarmtalk::view
