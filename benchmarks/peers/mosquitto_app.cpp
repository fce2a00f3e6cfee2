// The two programs of a run over an MQTT broker at MQTT_HOST, QoS 0.
#include <mosquitto.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include "benchmarks/peers/window.hpp"

namespace {

using namespace peers;

class Sender {
 public:
  explicit Sender(mosquitto* client) : client_(client) {}
  bool send(const char* bytes, std::size_t size) {
    return mosquitto_publish(client_, nullptr, "peers", static_cast<int>(size), bytes, 0, false) ==
           MOSQ_ERR_SUCCESS;
  }
  void listen(std::uint32_t us) {
    const std::int64_t end_ns = now_ns() + std::int64_t{us} * 1000;
    for (std::int64_t now = now_ns(); now < end_ns; now = now_ns()) {
      mosquitto_loop(client_, static_cast<int>((end_ns - now) / 1'000'000) + 1, 1);
    }
  }
  void wait(std::uint32_t us) {
    mosquitto_loop_misc(client_);
    usleep(us);
  }
  void flush() {
    while (mosquitto_want_write(client_)) mosquitto_loop(client_, 10, 1);
  }

 private:
  mosquitto* client_;
};

void on_message(mosquitto*, void* receiver, const mosquitto_message* message) {
  static_cast<Receiver*>(receiver)->on_message(message->payload,
                                               static_cast<std::size_t>(message->payloadlen));
}
void on_subscribe(mosquitto*, void* receiver, int, int, const int*) {
  static_cast<Receiver*>(receiver)->ready();
}

void on_swarm_message(mosquitto*, void* ear, const mosquitto_message* message) {
  static_cast<SwarmEar*>(ear)->on_message(message->payload,
                                          static_cast<std::size_t>(message->payloadlen));
}

int swarm(const Run& run, mosquitto* client) {
  SwarmEar ear(run);
  mosquitto_user_data_set(client, &ear);
  mosquitto_message_callback_set(client, &on_swarm_message);
  for (int i = 0; i < 20; ++i) mosquitto_loop(client, 10, 1);
  mosquitto_subscribe(client, nullptr, "peers", 0);
  Sender robot(client);
  return run_swarm(run, ear, robot);
}

}  // namespace

int main(int argc, char** argv) {
  const Run run = parse(argc, argv);
  const char* host = std::getenv("MQTT_HOST");
  mosquitto_lib_init();
  Receiver receiver(run);
  mosquitto* client = mosquitto_new(nullptr, true, &receiver);
  mosquitto_int_option(client, MOSQ_OPT_TCP_NODELAY, 1);
  if (mosquitto_connect(client, host != nullptr ? host : "127.0.0.1", 1883, 60) !=
      MOSQ_ERR_SUCCESS) {
    std::fprintf(stderr, "no broker at MQTT_HOST\n");
    return 1;
  }
  if (run.is_swarm) return swarm(run, client);
  if (run.is_sender) {
    for (int i = 0; i < 20; ++i) mosquitto_loop(client, 10, 1);
    Sender sender(client);
    return run_sender(run, sender);
  }
  mosquitto_message_callback_set(client, &on_message);
  mosquitto_subscribe_callback_set(client, &on_subscribe);
  mosquitto_subscribe(client, nullptr, "peers", 0);
  while (!receiver.is_complete() && !receiver.has_stalled()) mosquitto_loop(client, 200, 1);
  return receiver.report();
}
