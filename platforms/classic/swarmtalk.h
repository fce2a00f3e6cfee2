// What programs of 2020 and earlier include as "swarmtalk.h": core/classic/swarmtalk.h, the C
// library that came with it, and the older names. Give this folder to the compiler (-I) and link a
// home, which has main(): linux_home.cpp here, or platforms/kilobot/classic_home.cpp.
#pragma once

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/classic/swarmtalk.h"

// Before the release a program stood between these and had pointers to a node and a system.
#define START_USER_PROGRAM
#define END_USER_PROGRAM
#define swarmnet (&swarmtalk_instance)
#define swarmos (swarmtalk_instance.sys)

// A Kilobot's colours, two bits each, which older programs set themselves.
#ifndef RGB
#define RGB(r, g, b) (((r)&3) | ((g)&3) << 2 | ((b)&3) << 4)
inline void set_color(uint8_t colour) {
  LED_control->stay((colour & 3) * 85, (colour >> 2 & 3) * 85, (colour >> 4 & 3) * 85);
}
#endif

#ifdef __AVR__
// A Kilobot has nowhere to print to.
#undef printf
#define printf(...) (0)
#endif
