# Flags of all AVR builds (a Kilobot is an ATmega328P at 8 MHz): smallest code that gcc-avr 5.4 makes.
set(SWARMTALK_AVR_FLAGS
  -std=c++14 -mmcu=atmega328p -DF_CPU=8000000UL -Os -flto -mrelax -mcall-prologues
  -mstrict-X -fno-move-loop-invariants -fno-guess-branch-probability
  -ffunction-sections -fdata-sections -Wl,--gc-sections
  -fno-ipa-sra -fno-forward-propagate -fno-tree-scev-cprop -fno-tree-ccp
  -fno-exceptions -fno-rtti -fno-threadsafe-statics -funsigned-char -fshort-enums)
