// Runs an ATmega328P image in libsimavr and prints what it writes to GPIOR2, a character at a time,
// until it sleeps with interrupts off. Usage: avr_console IMAGE.elf
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_io.h>

#include <cstdio>

namespace {

constexpr avr_io_addr_t kGpior2 = 0x4B;  // data space address on the ATmega328P

void on_write(avr_t* avr, avr_io_addr_t address, uint8_t value, void*) {
  avr->data[address] = value;
  std::putchar(value);
}

}  // namespace

int main(int argc, char** argv) {
  elf_firmware_t firmware = {};
  if (argc != 2 || elf_read_firmware(argv[1], &firmware) != 0) {
    std::fprintf(stderr, "usage: avr_console IMAGE.elf\n");
    return 2;
  }
  avr_t* avr = avr_make_mcu_by_name("atmega328p");
  if (avr == nullptr) return 2;
  avr_init(avr);
  avr->log = LOG_NONE;
  avr->frequency = 8'000'000;
  avr_load_firmware(avr, &firmware);
  avr_register_io_write(avr, kGpior2, &on_write, nullptr);
  int state = cpu_Running;
  while (state != cpu_Done && state != cpu_Crashed && avr->cycle < 400'000'000) {
    state = avr_run(avr);
  }
  return state == cpu_Done ? 0 : 1;
}
