#include "view/source.hpp"

#include <cstdlib>

#include "report/harvest_text.hpp"

namespace swarmtalk::view {

void Source::take_message(const Message& message, Time at, std::size_t size_bytes) {
  const std::uint64_t number = traffic_.note_message(message, at);
  // Sensing is of the last transmitter, which is the sender only where nobody forwarded it.
  if (message.hops == 0 && !message.local && !message.origin && message.sender_pose) {
    swarm_.note_place(message.sender, *message.sender_pose, at);
  }
  const HeardMessage heard{number,
                           message.channel,
                           message.sender,
                           message.transmitter,
                           message.hops,
                           message.local,
                           message.distance_m,
                           message.bearing_rad,
                           message.lost_before,
                           message.payload,
                           at,
                           size_bytes};
  keep(heard);
  on_message(heard);
}

const std::deque<HeardMessage>& Source::recent_messages(std::uint16_t /*channel*/) const {
  static const std::deque<HeardMessage> kNone;
  return kNone;
}

void Source::take_line(std::uint32_t robot, const std::string& text, Time at) {
  on_line(traffic_.note_line(robot, text, at));
}

// Answers to whoever asked: values of programs are shown wherever they are heard.
void Source::take_harvest(const Message& message, Time at) {
  if (reports_.take(message, swarm_, at)) return;
  report::decode_answer(message.payload, [&](std::string_view key, std::string_view value) {
    swarm_.note_value(message.sender, std::string(key.substr(0, 64)),
                      std::string(value.substr(0, 512)));
  });
}

bool is_channel_number(const std::string& name) {
  return !name.empty() && name.size() <= 5 &&
         name.find_first_not_of("0123456789") == std::string::npos &&
         std::atoi(name.c_str()) <= 65535;
}

}  // namespace swarmtalk::view
