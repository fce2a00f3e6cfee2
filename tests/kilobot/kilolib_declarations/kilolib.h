/* What our adapter uses of kilolib, declared for a compile test; the real header is not ours and is
   not here. Written from the names and types that kilolib's users call. */
#pragma once

#include <stdint.h>

typedef struct {
  uint8_t data[9];
  uint8_t type;
  uint16_t crc;
} message_t;

typedef struct {
  int16_t low_gain;
  int16_t high_gain;
} distance_measurement_t;

typedef void (*message_rx_t)(message_t*, distance_measurement_t*);
typedef message_t* (*message_tx_t)(void);
typedef void (*message_tx_success_t)(void);

extern volatile uint32_t kilo_ticks;
extern uint16_t kilo_uid;
extern uint8_t kilo_turn_left, kilo_turn_right, kilo_straight_left, kilo_straight_right;
extern message_rx_t kilo_message_rx;
extern message_tx_t kilo_message_tx;
extern message_tx_success_t kilo_message_tx_success;

void kilo_init(void);
void kilo_start(void (*setup)(void), void (*loop)(void));
uint8_t estimate_distance(const distance_measurement_t*);
uint16_t message_crc(const message_t*);
uint8_t rand_hard(void);
void set_color(uint8_t);
void set_motors(uint8_t left, uint8_t right);
void spinup_motors(void);

#define RGB(r, g, b) (((r)&3) | (((g)&3) << 2) | (((b)&3) << 4))
