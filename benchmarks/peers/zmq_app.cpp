// The programs of a run over ZeroMQ, PUB and SUB over TCP. ZMQ_PEERS: the addresses of the robots,
// separated by commas, the first one's the sender's; in a swarm each binds its own and connects to
// all others.
#include <unistd.h>
#include <zmq.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <string>
#include <vector>

#include "benchmarks/peers/window.hpp"

namespace {

using namespace peers;

constexpr int kHighWater = 10000;  // messages; as many as the others' queues hold, or more
constexpr const char* kPort = ":5555";

std::vector<std::string> addresses() {
  const char* list = std::getenv("ZMQ_PEERS");
  std::istringstream words(list != nullptr ? list : "127.0.0.1");
  std::vector<std::string> result;
  for (std::string word; std::getline(words, word, ',');) {
    result.push_back("tcp://" + word + kPort);
  }
  return result;
}

void set(void* socket, int option, int value) {
  zmq_setsockopt(socket, option, &value, sizeof value);
}

void* open_publisher(void* context, const std::string& address) {
  void* socket = zmq_socket(context, ZMQ_PUB);
  set(socket, ZMQ_SNDHWM, kHighWater);
  if (zmq_bind(socket, address.c_str()) == 0) return socket;
  std::fprintf(stderr, "zmq_app: %s: %s\n", address.c_str(), zmq_strerror(zmq_errno()));
  std::exit(1);
}

void* open_subscriber(void* context) {
  void* socket = zmq_socket(context, ZMQ_SUB);
  set(socket, ZMQ_RCVHWM, kHighWater);
  zmq_setsockopt(socket, ZMQ_SUBSCRIBE, "", 0);
  return socket;
}

/// Waits so long for messages, and takes all that are there.
template <class Ear>
void read(void* socket, long timeout_ms, std::vector<char>& buffer, Ear& ear) {
  zmq_pollitem_t item{socket, 0, ZMQ_POLLIN, 0};
  if (zmq_poll(&item, 1, timeout_ms) <= 0) return;
  for (;;) {
    const int size = zmq_recv(socket, buffer.data(), buffer.size(), ZMQ_DONTWAIT);
    if (size < 0) return;
    ear.on_message(buffer.data(), static_cast<std::size_t>(size));
  }
}

class Sender {
 public:
  explicit Sender(void* socket) : socket_(socket) {}
  bool send(const char* bytes, std::size_t size) {
    return zmq_send(socket_, bytes, size, ZMQ_DONTWAIT) >= 0;
  }
  void wait(std::uint32_t us) { usleep(us); }
  void flush() {}

 private:
  void* socket_;
};

class Robot : public Sender {
 public:
  Robot(void* publisher, void* subscriber, const Run& run, SwarmEar& ear)
      : Sender(publisher), subscriber_(subscriber), buffer_(run.size_bytes), ear_(ear) {}
  void listen(std::uint32_t us) {
    const std::int64_t end_ns = now_ns() + std::int64_t{us} * 1000;
    for (std::int64_t now = now_ns(); now < end_ns; now = now_ns()) {
      read(subscriber_, static_cast<long>((end_ns - now) / 1'000'000) + 1, buffer_, ear_);
    }
  }

 private:
  void* subscriber_;
  std::vector<char> buffer_;
  SwarmEar& ear_;
};

int receive(const Run& run, void* context) {
  void* socket = open_subscriber(context);
  zmq_connect(socket, addresses().front().c_str());
  usleep(200'000);  // of the sender, which waits for us, the socket is there already
  Receiver receiver(run);
  std::vector<char> buffer(run.size_bytes);
  receiver.ready();
  while (!receiver.is_complete() && !receiver.has_stalled()) read(socket, 200, buffer, receiver);
  return receiver.report();
}

int send(const Run& run, void* context) {
  Sender sender(open_publisher(context, addresses().front()));
  usleep(1'000'000);  // until the receivers have connected: TCP tries again every 100 ms
  const int code = run_sender(run, sender);
  // What waits in the context goes with it.
  for (int i = 0; i < 200 && run.slowest() < run.count; ++i) usleep(10'000);
  return code;
}

int swarm(const Run& run, void* context) {
  const std::vector<std::string> all = addresses();
  void* publisher = open_publisher(context, all.at(run.index));
  void* subscriber = open_subscriber(context);
  for (std::uint32_t i = 0; i < run.robots; ++i) {
    if (i != run.index) zmq_connect(subscriber, all.at(i).c_str());
  }
  SwarmEar ear(run);
  Robot robot(publisher, subscriber, run, ear);
  return run_swarm(run, ear, robot);
}

}  // namespace

int main(int argc, char** argv) {
  const Run run = parse(argc, argv);
  void* context = zmq_ctx_new();
  const int code = run.is_swarm    ? swarm(run, context)
                   : run.is_sender ? send(run, context)
                                   : receive(run, context);
  std::fflush(stdout);
  std::_Exit(code);  // sockets that still have a peer would hold the context up
}
