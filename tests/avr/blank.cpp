// The follower without the library: what the two images differ by is the library and the program.
#include <avr/io.h>
#include <string.h>

extern "C" {
volatile uint8_t command;
uint8_t packet[9];
volatile uint8_t result;
}

int main() {
  for (;;) {
    PORTC = TCNT0;
    if (command == 1) {
      GPIOR1 = 1;
      result = packet[0];
      GPIOR1 = 0;
    }
    command = 0;
  }
}
