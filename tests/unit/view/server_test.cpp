// What a port of the view answers: to requests of HTTP and to WebSockets, written here byte by byte
// (RFC 9112, RFC 6455), and how many are let in.
#include "view/server.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/post.hpp>
#include <functional>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/patience.hpp"
#include "tests/unit/view/told_source.hpp"
#include "view/page.hpp"

namespace swarmtalk::view {
namespace {

struct Frame {
  unsigned opcode = 0;
  std::string bytes;
};
enum Opcode : unsigned { kText = 1, kBinary = 2, kClose = 8 };

/// One TCP connection to a port of this machine.
class Caller {
 public:
  explicit Caller(std::uint16_t port) : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
    host_ = "localhost:" + std::to_string(port);
  }
  Caller(const Caller&) = delete;
  Caller& operator=(const Caller&) = delete;
  ~Caller() { ::close(fd_); }

  void write(const std::string& bytes) const {
    EXPECT_EQ(::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(bytes.size()));
  }
  /// Waits for so many bytes, or until the other side ends. @return false: it has ended before
  bool wait_for(std::size_t size) {
    while (read_.size() < size) {
      pollfd waited{fd_, POLLIN, 0};
      const std::chrono::milliseconds patience = test::kPatience;
      if (::poll(&waited, 1, static_cast<int>(patience.count())) != 1) {
        ADD_FAILURE() << "nothing comes";
        return false;
      }
      char bytes[65536];
      const ssize_t count = ::recv(fd_, bytes, sizeof(bytes), 0);
      if (count <= 0) return false;
      read_.append(bytes, static_cast<std::size_t>(count));
    }
    return true;
  }
  std::string take(std::size_t size) {
    const std::string taken = wait_for(size) ? read_.substr(0, size) : std::string();
    read_.erase(0, taken.size());
    return taken;
  }
  bool is_ended() { return !wait_for(read_.size() + 1); }

  /// The whole answer to a request of HTTP.
  std::string ask(const std::string& line, const std::string& headers = {}) {
    write(line + " HTTP/1.1\r\nHost: " + host_ + "\r\n" + headers + "\r\n");
    while (!is_ended()) continue;
    return read_;
  }

  /// Asks for a WebSocket. @return the head of the answer
  std::string upgrade(const std::string& subprotocols = {}) {
    write("GET / HTTP/1.1\r\nHost: " + host_ +
          "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
          "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n" +
          (subprotocols.empty() ? "" : "Sec-WebSocket-Protocol: " + subprotocols + "\r\n") +
          "\r\n");
    while (read_.find("\r\n\r\n") == std::string::npos) {
      if (!wait_for(read_.size() + 1)) return read_;
    }
    return take(read_.find("\r\n\r\n") + 4);
  }
  /// Masked with 0.
  void send(unsigned opcode, const std::string& bytes, bool is_last = true) const {
    std::string frame(1, static_cast<char>((is_last ? 0x80 : 0) | opcode));
    if (bytes.size() < 126) {
      frame.push_back(static_cast<char>(0x80 | bytes.size()));
    } else {
      const bool is_long = bytes.size() > 65535;
      frame.push_back(static_cast<char>(0x80 | (is_long ? 127 : 126)));
      for (int shift = is_long ? 56 : 8; shift >= 0; shift -= 8) {
        frame.push_back(static_cast<char>(bytes.size() >> shift & 0xFF));
      }
    }
    write(frame + std::string(4, '\0') + bytes);
  }
  Frame next() {
    const std::string head = take(2);
    if (head.empty()) return {};
    std::size_t size = static_cast<unsigned char>(head[1]);
    if (size >= 126) {
      std::size_t longer = 0;
      for (const char byte : take(size == 126 ? 2 : 8)) {
        longer = longer << 8 | static_cast<unsigned char>(byte);
      }
      size = longer;
    }
    return {static_cast<unsigned>(head[0]) & 0x0F, take(size)};
  }
  /// The next JSON text that is no state of the swarm.
  nlohmann::json next_event() {
    while (true) {
      const Frame frame = next();
      EXPECT_EQ(frame.opcode, kText) << frame.bytes;
      if (frame.opcode != kText) return {};
      nlohmann::json told = nlohmann::json::parse(frame.bytes);
      if (told["t"] != "state" && told["t"] != "info") return told;
    }
  }
  /// Code and words of the closing frame that comes at last.
  std::pair<unsigned, std::string> closing() {
    Frame frame;
    do {
      frame = next();
    } while (frame.opcode == kText || frame.opcode == kBinary);
    EXPECT_EQ(frame.opcode, kClose);
    if (frame.bytes.size() < 2) return {};
    send(kClose, frame.bytes.substr(0, 2));
    return {static_cast<unsigned char>(frame.bytes[0]) * 256u +
                static_cast<unsigned char>(frame.bytes[1]),
            frame.bytes.substr(2)};
  }

 private:
  int fd_;
  std::string host_;
  std::string read_;
};

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

class ServerTest : public ::testing::Test {
 protected:
  ServerTest() {
    thread_ = std::thread([this] { io_.run(); });
  }
  ~ServerTest() override {
    on_thread([this] { server_.stop(); });
    work_.reset();
    thread_.join();
  }
  void on_thread(std::function<void()> task) {
    std::packaged_task<void()> packaged(std::move(task));
    std::future<void> done = packaged.get_future();
    boost::asio::post(io_, std::move(packaged));
    done.get();
  }
  std::uint16_t port() const { return server_.rules().port; }
  std::unique_ptr<Caller> caller() const { return std::make_unique<Caller>(port()); }
  std::size_t viewers() {
    std::size_t count = 0;
    on_thread([&] { count = stage_.viewers(); });
    return count;
  }
  void wait_for_viewers(std::size_t wanted) {
    const auto deadline = Clock::now() + test::kPatience;
    while (viewers() != wanted) ASSERT_LT(Clock::now(), deadline) << viewers() << " look";
  }

  boost::asio::io_context io_;
  std::optional<boost::asio::executor_work_guard<boost::asio::io_context::executor_type>> work_{
      io_.get_executor()};
  ToldSource source_;
  Stage stage_{io_, source_, false};
  Server server_{io_, "127.0.0.1", AccessRules{}, stage_};
  std::thread thread_;
};

TEST_F(ServerTest, AnswersForThePageAndSaysWhatElseThereIsNot) {
  const std::string got = caller()->ask("GET /?token=x");
  EXPECT_TRUE(got.starts_with("HTTP/1.1 200 ")) << got.substr(0, 100);
  EXPECT_TRUE(contains(got, "Content-Type: text/html; charset=utf-8\r\n"));
  EXPECT_TRUE(contains(got, "frame-ancestors 'none'"));
  EXPECT_TRUE(got.ends_with("\r\n\r\n" + std::string(page())));
  EXPECT_TRUE(caller()->ask("GET /index.html").ends_with(std::string(page())));
  const std::string head = caller()->ask("HEAD /");
  EXPECT_TRUE(head.starts_with("HTTP/1.1 200 ") && head.ends_with("\r\n\r\n")) << head;
  const std::string missing = caller()->ask("GET /page");
  EXPECT_TRUE(missing.starts_with("HTTP/1.1 404 ")) << missing;
  EXPECT_TRUE(missing.ends_with("there is one page, at /\n"));
  EXPECT_TRUE(caller()->ask("DELETE /").starts_with("HTTP/1.1 405 "));
  EXPECT_TRUE(caller()->ask("GET /", "Origin: http://elsewhere\r\n").starts_with("HTTP/1.1 403 "));
  EXPECT_TRUE(caller()->ask("nonsense").starts_with("HTTP/1.1 400 "));
  EXPECT_EQ(viewers(), 0u);
}

TEST_F(ServerTest, SpeaksWhatIsOfferedAndSaysWhichItWouldSpeak) {
  const auto chosen = [&](const std::string& offered) {
    const std::string head = caller()->upgrade(offered);
    const std::string key = "Sec-WebSocket-Protocol: ";
    const std::size_t at = head.find(key);
    if (at == std::string::npos) return head.substr(0, 12);
    return head.substr(at + key.size(), head.find('\r', at) - at - key.size());
  };
  EXPECT_EQ(chosen(""), "HTTP/1.1 101");
  EXPECT_EQ(chosen("swarmtalk.view.v1"), "swarmtalk.view.v1");
  EXPECT_EQ(chosen("foxglove.websocket.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(chosen("other, foxglove.websocket.v1, foxglove.sdk.v1"), "foxglove.sdk.v1");
  EXPECT_EQ(chosen("other"), "HTTP/1.1 400");
  auto page = caller();
  page->upgrade("swarmtalk.view.v1");
  EXPECT_EQ(page->next_event()["t"], "hello");
  auto foxglove = caller();
  foxglove->upgrade("foxglove.sdk.v1");
  EXPECT_TRUE(contains(foxglove->next().bytes, "serverInfo"));
}

TEST_F(ServerTest, TakesTextsWholeAndInPiecesUpToALength) {
  auto page = caller();
  page->upgrade();
  EXPECT_EQ(page->next_event()["t"], "hello");
  page->send(kText, R"({"op": )", false);
  page->send(0, R"("dance"})");
  EXPECT_EQ(page->next_event()["text"], "there is no request of that name");
  page->send(kBinary, R"({"op": "dance"})");
  EXPECT_EQ(page->next_event()["text"], "requests are JSON texts, not binary");
  page->send(kText, std::string(65536, 'x'));
  EXPECT_EQ(page->next_event()["text"], "a request is a JSON object with \"op\"");
  page->send(kText, std::string(65537, 'x'));
  EXPECT_EQ(page->closing(),
            (std::pair<unsigned, std::string>(1009, "a message may have 65536 bytes at most")));
  EXPECT_TRUE(page->is_ended());
  page.reset();
  wait_for_viewers(0);
}

TEST_F(ServerTest, ClosesWhoAsksTooMuchNonsenseAndSaysWhy) {
  auto page = caller();
  page->upgrade();
  for (int i = 0; i < 16; ++i) page->send(kText, "{}");
  EXPECT_EQ(page->closing(),
            (std::pair<unsigned, std::string>(
                1008, "too many bad requests; the last: a request is a JSON object with \"op\"")));
  EXPECT_TRUE(page->is_ended());
  page.reset();
  wait_for_viewers(0);
}

TEST_F(ServerTest, WritesAllThatHappensInItsOrder) {
  auto page = caller();
  page->upgrade();
  EXPECT_EQ(page->next_event()["t"], "hello");
  on_thread([this] {
    for (int i = 0; i < 400; ++i) source_.take_line(7, std::string(900, 'x'), kToldSourceNow);
  });
  for (int i = 1; i <= 400; ++i) ASSERT_EQ(page->next_event()["k"], i);
}

TEST_F(ServerTest, LetsInSoManyViewersAndTellsTheNextThatThereAreNoMore) {
  const std::string sentence = "128 viewers look already, the most there may be: close some pages";
  std::vector<std::unique_ptr<Caller>> pages;
  for (std::size_t i = 0; i < Server::kMostViewers; ++i) {
    pages.push_back(caller());
    pages.back()->upgrade();
  }
  wait_for_viewers(Server::kMostViewers);
  const std::string answer = caller()->ask("GET /");
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 503 ") && answer.ends_with("\r\n\r\n" + sentence + "\n"))
      << answer;
  auto turned_away = caller();
  turned_away->upgrade();
  EXPECT_EQ(turned_away->closing(), (std::pair<unsigned, std::string>(1013, sentence)));
  EXPECT_TRUE(turned_away->is_ended());
  EXPECT_EQ(viewers(), Server::kMostViewers);
  pages.pop_back();
  wait_for_viewers(Server::kMostViewers - 1);
  EXPECT_TRUE(caller()->ask("GET /").starts_with("HTTP/1.1 200 "));
  auto next = caller();
  next->upgrade();
  EXPECT_EQ(next->next_event()["t"], "hello");
}

TEST_F(ServerTest, OfConnectionsThatAskForNothingTheOldestMakesPlace) {
  auto page = caller();
  page->upgrade();
  EXPECT_EQ(page->next_event()["t"], "hello");
  std::vector<std::unique_ptr<Caller>> silent;
  for (std::size_t i = 0; i + 1 < Server::kMostConnections; ++i) silent.push_back(caller());
  EXPECT_TRUE(caller()->ask("GET /").starts_with("HTTP/1.1 200 "));
  EXPECT_TRUE(silent[0]->is_ended());
  auto last = caller();
  last->upgrade();
  EXPECT_EQ(last->next_event()["t"], "hello");
  // The second was there long enough to be answered.
  EXPECT_TRUE(silent[1]->ask("GET /").starts_with("HTTP/1.1 200 "));
  page->send(kText, "{}");
  EXPECT_EQ(page->next_event()["t"], "notice") << "who looks keeps a place";
}

TEST_F(ServerTest, EndsAllConnectionsWhenItStops) {
  auto page = caller();
  page->upgrade();
  EXPECT_EQ(page->next_event()["t"], "hello");
  auto silent = caller();
  EXPECT_TRUE(caller()->ask("GET /").starts_with("HTTP/1.1 200 ")) << "the silent one is taken";
  on_thread([this] { server_.stop(); });
  EXPECT_TRUE(silent->is_ended());
  while (page->next().opcode != 0) continue;
  wait_for_viewers(0);
}

TEST(ServerOf, AnAddressThatIsNoneOrAPortInUseSaysWhatToDo) {
  boost::asio::io_context io;
  ToldSource source;
  Stage stage(io, source, false);
  const auto why = [&](const std::string& address, std::uint16_t port) -> std::string {
    try {
      AccessRules rules;
      rules.port = port;
      const Server server(io, address, rules, stage);
      return server.is_local_only() ? "local" : "open";
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  };
  EXPECT_EQ(why("127.0.0.1", 0), "local");
  EXPECT_EQ(why("0.0.0.0", 0), "open");
  EXPECT_EQ(why("robot", 0),
            "--listen takes an address of this machine, such as 127.0.0.1 or 0.0.0.0, not robot");
  EXPECT_EQ(why("203.0.113.1", 8080),
            "cannot listen on 203.0.113.1 port 8080: Cannot assign requested address; --listen "
            "takes an address of this machine");
  const Server server(io, "127.0.0.1", AccessRules{}, stage);
  const std::uint16_t used = server.rules().port;
  EXPECT_EQ(why("127.0.0.1", used), "cannot listen on 127.0.0.1 port " + std::to_string(used) +
                                        ": Address already in use; take another with --port");
}

}  // namespace
}  // namespace swarmtalk::view
