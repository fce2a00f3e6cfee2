// The two programs of a run over Cyclone DDS, best effort, discovery by multicast.
#include <dds/dds.h>
#include <unistd.h>

#include "benchmarks/peers/window.hpp"
#include "dds_message.h"

namespace {

using namespace peers;

class Sender {
 public:
  explicit Sender(dds_entity_t writer) : writer_(writer) {}
  bool send(const char* bytes, std::size_t size) {
    peers_DdsMessage message{};
    message.bytes._buffer = reinterpret_cast<std::uint8_t*>(const_cast<char*>(bytes));
    message.bytes._length = message.bytes._maximum = static_cast<std::uint32_t>(size);
    return dds_write(writer_, &message) == DDS_RETCODE_OK;
  }
  void wait(std::uint32_t us) { usleep(us); }
  void flush() {}
  void listen(std::uint32_t us) { usleep(us); }  // a thread of the library hears

 private:
  dds_entity_t writer_;
};

bool wait_for_reader(dds_entity_t writer) {
  for (int i = 0; i < 1000; ++i) {
    dds_publication_matched_status_t status;
    if (dds_get_publication_matched_status(writer, &status) == 0 && status.current_count > 0)
      return true;
    usleep(10'000);
  }
  return false;
}

template <class Ear>
void on_data(dds_entity_t reader, void* ear) {
  void* samples[64] = {};
  dds_sample_info_t infos[64];
  for (;;) {
    const int count = dds_take(reader, samples, infos, 64, 64);
    if (count <= 0) return;
    for (int i = 0; i < count; ++i) {
      if (!infos[i].valid_data) continue;
      const auto* message = static_cast<const peers_DdsMessage*>(samples[i]);
      static_cast<Ear*>(ear)->on_message(message->bytes._buffer, message->bytes._length);
    }
    dds_return_loan(reader, samples, count);
  }
}

int swarm(const Run& run, dds_entity_t participant, dds_entity_t topic, dds_qos_t* qos) {
  SwarmEar ear(run);
  dds_listener_t* listener = dds_create_listener(&ear);
  dds_lset_data_available(listener, &on_data<SwarmEar>);
  dds_create_reader(participant, topic, qos, listener);
  Sender robot(dds_create_writer(participant, topic, qos, nullptr));
  return run_swarm(run, ear, robot);
}

}  // namespace

int main(int argc, char** argv) {
  const Run run = parse(argc, argv);
  const dds_entity_t participant = dds_create_participant(DDS_DOMAIN_DEFAULT, nullptr, nullptr);
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 4096);
  const dds_entity_t topic =
      dds_create_topic(participant, &peers_DdsMessage_desc, "peers", nullptr, nullptr);
  if (run.is_swarm) return swarm(run, participant, topic, qos);
  if (run.is_sender) {
    const dds_entity_t writer = dds_create_writer(participant, topic, qos, nullptr);
    if (!wait_for_reader(writer)) return 1;
    Sender sender(writer);
    return run_sender(run, sender);
  }
  Receiver receiver(run);
  dds_listener_t* listener = dds_create_listener(&receiver);
  dds_lset_data_available(listener, &on_data<Receiver>);
  receiver.ready();
  dds_create_reader(participant, topic, qos, listener);
  while (!receiver.is_complete() && !receiver.has_stalled()) usleep(20'000);
  return receiver.report();
}
