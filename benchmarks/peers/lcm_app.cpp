// The two programs of a run over LCM (udpm, multicast).
#include <lcm/lcm.h>
#include <unistd.h>

#include "benchmarks/peers/window.hpp"

namespace {

using namespace peers;

class Sender {
 public:
  explicit Sender(lcm_t* lcm) : lcm_(lcm) {}
  bool send(const char* bytes, std::size_t size) {
    return lcm_publish(lcm_, "peers", bytes, static_cast<unsigned>(size)) == 0;
  }
  void wait(std::uint32_t us) { usleep(us); }
  void flush() {}
  void listen(std::uint32_t us) {
    const std::int64_t end_ns = now_ns() + std::int64_t{us} * 1000;
    for (std::int64_t now = now_ns(); now < end_ns; now = now_ns()) {
      // Whole milliseconds: below, the rest is slept.
      const int left_ms = static_cast<int>((end_ns - now) / 1'000'000);
      if (lcm_handle_timeout(lcm_, left_ms) == 0 && left_ms == 0) {
        usleep(static_cast<useconds_t>(std::max<std::int64_t>((end_ns - now_ns()) / 1000, 0)));
      }
    }
  }

 private:
  lcm_t* lcm_;
};

void on_message(const lcm_recv_buf_t* buffer, const char*, void* receiver) {
  static_cast<Receiver*>(receiver)->on_message(buffer->data, buffer->data_size);
}

void on_swarm_message(const lcm_recv_buf_t* buffer, const char*, void* ear) {
  static_cast<SwarmEar*>(ear)->on_message(buffer->data, buffer->data_size);
}

int swarm(const Run& run, lcm_t* lcm) {
  SwarmEar ear(run);
  lcm_subscription_set_queue_capacity(lcm_subscribe(lcm, "peers", &on_swarm_message, &ear), 4096);
  Sender robot(lcm);
  return run_swarm(run, ear, robot);
}

}  // namespace

int main(int argc, char** argv) {
  const Run run = parse(argc, argv);
  lcm_t* lcm = lcm_create("udpm://239.255.76.67:7667?ttl=1&recv_buf_size=4194304");
  if (lcm == nullptr) return 1;
  if (run.is_swarm) return swarm(run, lcm);
  if (run.is_sender) {
    Sender sender(lcm);
    return run_sender(run, sender);
  }
  Receiver receiver(run);
  lcm_subscription_set_queue_capacity(lcm_subscribe(lcm, "peers", &on_message, &receiver), 4096);
  receiver.ready();
  while (!receiver.is_complete() && !receiver.has_stalled()) lcm_handle_timeout(lcm, 200);
  return receiver.report();
}
