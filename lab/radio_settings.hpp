// What a lab's radio medium is started with.
#pragma once

namespace swarmtalk::lab {

struct RadioSettings {
  double range_m = 50;  // at 6 Mb/s, with nobody else on the air
  double loss = 0;      // share of receptions that fail, each by itself
  int rate_mbps = 6;    // of broadcasts: 6 to 54, those of OFDM
};

}  // namespace swarmtalk::lab
