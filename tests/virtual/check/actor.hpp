// Actor: a program of a story while it runs. What it sends and hears goes into the record.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include <swarmtalk/client.hpp>

#include "tests/virtual/check/record.hpp"
#include "tests/virtual/check/story.hpp"
#include "tests/virtual/swarm.hpp"

namespace swarmtalk::test {

class Actor {
 public:
  struct Place {
    int robot = 0;
    int program = 0;
  };

  /// All references must outlive it.
  /// @param known  messages sent, by their text
  /// @param run    of its robot's daemon, at any time
  Actor(VirtualProgram& program, Place place, const ProgramPlan& plan, Record& record,
        const std::unordered_map<std::string, int>& known, const int& run);
  Actor(const Actor&) = delete;
  Actor& operator=(const Actor&) = delete;
  ~Actor();

  static std::string channel_name(int channel) { return {static_cast<char>('a' + channel)}; }

  /// @return false: it was not taken
  bool send(int channel, const std::string& text, std::uint32_t ttl);

  /// A program that started before its daemon is told of no reconnection when that comes.
  void look_for_connection();

  /// Nothing of it goes into the record any more. @param is_open  the story is over, and not it
  void leave(bool is_open);

  /// Of the record's processes.
  int process() const { return process_; }

  bool is_paused = false;

 private:
  struct Answers {
    std::uint64_t all = 0;
    std::uint64_t refused = 0;  // unsent, as far as is known
  };
  struct Mouth {
    Publisher publisher;
    std::size_t index = 0;             // in Record::publishings
    std::shared_ptr<Answers> answers;  // its callback may be called after the Actor's end
    bool is_whole = true;              // each message leaves in one packet, once
  };

  void publish(int channel);
  void begin_hearings();
  void end_hearings();
  void hear(int channel, const Message& message);

  Client& client_;
  Place place_;
  int process_;
  ProgramPlan plan_;
  Record& record_;
  const std::unordered_map<std::string, int>& known_;
  const int& run_;
  bool has_left_ = false;
  std::map<int, Mouth> publishers_;
  std::map<int, std::size_t> hearings_;  // in Record::hearings, by channel
  std::vector<Subscriber> subscribers_;
};

}  // namespace swarmtalk::test
