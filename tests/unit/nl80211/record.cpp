// nl80211_recorder INTERFACE: asks the kernel's 802.11 what doctor asks and prints the answers, as
// tests/support/recorded_nl80211.hpp reads them. Its output is committed in tests/vectors/nl80211.
#include <linux/nl80211.h>
#include <net/if.h>

#include <cstdio>

#include "nl80211/radio.hpp"

namespace {

class Recorder final : public swarmtalk::nl80211::Asker {
 public:
  swarmtalk::nl80211::Answer ask(const swarmtalk::nl80211::Question& question) override {
    const auto answer = kernel_.ask(question);
    std::printf("answer %d %d\n", question.command, answer.error);
    for (const auto& message : answer.messages) {
      std::printf("message ");
      for (const unsigned byte : message) std::printf("%02x", byte);
      std::printf("\n");
    }
    return answer;
  }

 private:
  swarmtalk::nl80211::KernelAsker kernel_;
};

}  // namespace

int main(int argc, char** argv) {
  using namespace swarmtalk::nl80211;
  const unsigned index = argc == 2 ? if_nametoindex(argv[1]) : 0;
  if (index == 0) {
    std::fprintf(stderr, "usage: nl80211_recorder INTERFACE\n");
    return 2;
  }
  Recorder recorder;
  const auto interface = interface_of(recorder, index);
  stations_of(recorder, index);
  network_of(recorder, index);
  has_power_save(recorder, index);
  country_of(recorder, interface ? interface->wiphy : 0);
  return interface ? 0 : 1;
}
