// Runs cycles_target.elf in libsimavr and holds the most cycles that each call took against a
// budget.
//   cycles TARGET.elf [RECEIVE_LIMIT PULL_LIMIT]     exit 1 if one is exceeded
// Calls and returns are not counted apart, but the writes that bracket them are (2 cycles).
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_io.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>

namespace {

constexpr avr_io_addr_t kGpior1 = 0x4A;  // data space address on the ATmega328P

struct Meter {
  uint64_t began = 0;
  uint8_t situation = 0;
  std::map<uint8_t, uint64_t> worst;
};

void on_write(avr_t* avr, avr_io_addr_t address, uint8_t value, void* param) {
  auto& meter = *static_cast<Meter*>(param);
  avr->data[address] = value;
  if (value == 0) {
    uint64_t& worst = meter.worst[meter.situation];
    worst = std::max<uint64_t>(worst, avr->cycle - meter.began);
  } else {
    meter.situation = value;
    meter.began = avr->cycle;
  }
}

const char* name_of(uint8_t situation) {
  static const char* const kNames[] = {"",
                                       "pull, nothing waits",
                                       "pull a message of 1 packet",
                                       "pull a packet of 8",
                                       "receive and deliver a message of 1 packet",
                                       "receive a packet to forward",
                                       "pull a forwarded packet",
                                       "receive the 8th packet: reassemble and deliver",
                                       "receive a packet to hold",
                                       "receive a message of 1 packet, memory full",
                                       "receive a first packet, memory full",
                                       "receive a further packet, memory full: evict",
                                       "receive a copy with more TTL, queue full",
                                       "receive a first packet, forecast over 18 messages"};
  return kNames[situation];
}
bool is_pull(uint8_t situation) {
  return situation <= 3 || situation == 6;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  const uint64_t receive_limit = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : UINT64_MAX;
  const uint64_t pull_limit = argc > 3 ? std::strtoull(argv[3], nullptr, 10) : UINT64_MAX;
  elf_firmware_t firmware = {};
  if (elf_read_firmware(argv[1], &firmware) != 0) {
    std::fprintf(stderr, "cycles: cannot read %s\n", argv[1]);
    return 2;
  }
  avr_t* avr = avr_make_mcu_by_name("atmega328p");
  if (avr == nullptr) return 2;
  avr_init(avr);
  avr->frequency = 8'000'000;
  avr_load_firmware(avr, &firmware);
  Meter meter;
  avr_register_io_write(avr, kGpior1, &on_write, &meter);
  int state = cpu_Running;
  while (state != cpu_Done && state != cpu_Crashed && avr->cycle < 100'000'000) {
    state = avr_run(avr);
  }
  int result = state == cpu_Done ? 0 : 1;
  for (const auto& [situation, cycles] : meter.worst) {
    const uint64_t limit = is_pull(situation) ? pull_limit : receive_limit;
    std::printf("%6llu cycles  %s%s\n", static_cast<unsigned long long>(cycles), name_of(situation),
                cycles > limit ? "  OVER BUDGET" : "");
    if (cycles > limit) result = 1;
  }
  if (meter.worst.size() < 13) result = 1;
  return result;
}
