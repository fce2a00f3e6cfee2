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

 private:
  lcm_t* lcm_;
};

void on_message(const lcm_recv_buf_t* buffer, const char*, void* receiver) {
  static_cast<Receiver*>(receiver)->on_message(buffer->data, buffer->data_size);
}

}  // namespace

int main(int argc, char** argv) {
  const Run run = parse(argc, argv);
  lcm_t* lcm = lcm_create("udpm://239.255.76.67:7667?ttl=1&recv_buf_size=4194304");
  if (lcm == nullptr) return 1;
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
