#include "tests/avr/story.hpp"

#include <cstdio>
#include <fstream>
#include <istream>
#include <ostream>
#include <sstream>
#include <stdexcept>

namespace swarmtalk::avr {
namespace {

/// Reads the words of a line; whatever is missing or out of range makes it wrong.
class Line {
 public:
  explicit Line(const std::string& text) : words_(text) {}
  std::string word() {
    std::string word;
    words_ >> word;
    return word;
  }
  std::string rest() {
    std::string rest;
    std::getline(words_ >> std::ws, rest);
    return rest;
  }
  uint32_t number(uint32_t most, int base = 10) { return number_in(word(), most, base); }
  static uint32_t number_in(const std::string& word, uint32_t most, int base = 10) {
    size_t used = 0;
    unsigned long value = 0;
    try {
      value = std::stoul(word, &used, base);
    } catch (const std::exception&) {
      used = 0;
    }
    if (used == 0 || used != word.size() || value > most) {
      throw std::runtime_error("'" + word + "' is no number up to " + std::to_string(most));
    }
    return static_cast<uint32_t>(value);
  }
  uint8_t byte(uint32_t most = 255, int base = 10) {
    return static_cast<uint8_t>(number(most, base));
  }

 private:
  std::istringstream words_;
};

std::string after(const std::string& word, const std::string& key) {
  if (word.compare(0, key.size(), key) != 0) throw std::runtime_error(key + " is missing");
  return word.substr(key.size());
}

ChannelSetting read_channel(const std::string& word) {
  const size_t slash = word.find('/');
  if (slash == std::string::npos) throw std::runtime_error("a channel is NUMBER/TTL");
  return {static_cast<uint8_t>(Line::number_in(word.substr(0, slash), 15)),
          static_cast<uint8_t>(Line::number_in(word.substr(slash + 1), 15))};
}

Start read_start(Line& line) {
  Start start;
  const std::string id = after(line.word(), "id=");
  start.fixed_id =
      id == "drawn" ? kDrawnId : static_cast<uint8_t>(Line::number_in(id, kDrawnId - 1));
  start.random = Line::number_in(after(line.word(), "random="), UINT32_MAX);
  const std::string channels = after(line.word(), "channels=");
  const size_t comma = channels.find(',');
  if (comma == std::string::npos) throw std::runtime_error("two channels are needed");
  start.channels[0] = read_channel(channels.substr(0, comma));
  start.channels[1] = read_channel(channels.substr(comma + 1));
  if (start.channels[0].id == start.channels[1].id) throw std::runtime_error("one channel twice");
  return start;
}

Step read_hear(Line& line) {
  Step step;
  step.kind = Step::Kind::kHear;
  step.from = line.byte();
  step.message = line.byte(15);
  std::string sequence = line.word();
  if (!sequence.empty() && sequence.back() == 'e') {
    step.flags |= Step::kEnd;
    sequence.pop_back();
  }
  step.sequence = static_cast<uint8_t>(Line::number_in(sequence, 7));
  step.channel = line.byte(15);
  step.ttl = line.byte(15);
  step.body = line.byte(255, 16);
  for (std::string word = line.word(); !word.empty(); word = line.word()) {
    if (word == "own") {
      step.flags |= Step::kOwn;
    } else if (word == "far") {
      step.flags |= Step::kFar;
    } else if (word == "damaged") {
      step.flags |= Step::kDamaged;
    } else {
      throw std::runtime_error("'" + word + "' is no mark of a packet");
    }
  }
  return step;
}

Step read_step(const std::string& what, Line& line) {
  if (what == "hear") return read_hear(line);
  Step step;
  if (what == "echo") {
    step.kind = Step::Kind::kEcho;
    step.count = line.byte();
    step.ttl = line.byte(15);
  } else if (what == "pull") {
    step.kind = Step::Kind::kPull;
    step.count = line.byte();
    step.ticks = line.number(UINT32_MAX);
  } else if (what == "send") {
    step.kind = Step::Kind::kSend;
    step.channel = line.byte(1);
    step.count = line.byte(40);
    step.ttl = line.byte(15);
  } else if (what == "wait") {
    step.kind = Step::Kind::kWait;
    step.ticks = line.number(UINT32_MAX);
  } else {
    throw std::runtime_error("'" + what + "' is no step");
  }
  return step;
}

void read_line(const std::string& text, std::vector<Story>& stories) {
  Line line(text);
  const std::string what = line.word();
  if (what.empty() || what[0] == '#') return;
  if (what == "story") {
    stories.emplace_back();
    stories.back().name = line.word();
    return;
  }
  if (stories.empty()) throw std::runtime_error("a story begins with 'story NAME'");
  Story& story = stories.back();
  if (what == "start") {
    story.start = read_start(line);
  } else if (what == "as") {
    story.labels.push_back(line.rest());
  } else {
    story.steps.push_back(read_step(what, line));
    story.steps.back().label = static_cast<uint16_t>(story.labels.size() - 1);
  }
  if (!line.rest().empty()) throw std::runtime_error("the line goes on");
}

}  // namespace

std::string to_text(const Step& step) {
  char text[80] = "";
  switch (step.kind) {
    case Step::Kind::kHear:
      std::snprintf(text, sizeof text, "hear %u %u %u%s %u %u %02x%s%s%s", step.from, step.message,
                    step.sequence, (step.flags & Step::kEnd) != 0 ? "e" : "", step.channel,
                    step.ttl, step.body, (step.flags & Step::kOwn) != 0 ? " own" : "",
                    (step.flags & Step::kFar) != 0 ? " far" : "",
                    (step.flags & Step::kDamaged) != 0 ? " damaged" : "");
      break;
    case Step::Kind::kEcho:
      std::snprintf(text, sizeof text, "echo %u %u", step.count, step.ttl);
      break;
    case Step::Kind::kPull:
      std::snprintf(text, sizeof text, "pull %u %lu", step.count,
                    static_cast<unsigned long>(step.ticks));
      break;
    case Step::Kind::kSend:
      std::snprintf(text, sizeof text, "send %u %u %u", step.channel, step.count, step.ttl);
      break;
    case Step::Kind::kWait:
      std::snprintf(text, sizeof text, "wait %lu", static_cast<unsigned long>(step.ticks));
      break;
  }
  return text;
}

void write(std::ostream& out, const Story& story) {
  const Start& start = story.start;
  out << "story " << story.name << "\nstart id=";
  if (start.fixed_id == kDrawnId) {
    out << "drawn";
  } else {
    out << +start.fixed_id;
  }
  out << " random=" << start.random << " channels=" << +start.channels[0].id << '/'
      << +start.channels[0].ttl << ',' << +start.channels[1].id << '/' << +start.channels[1].ttl
      << '\n';
  uint16_t label = 0;
  for (const Step& step : story.steps) {
    if (step.label != label) {
      label = step.label;
      out << "as " << story.labels[label] << '\n';
    }
    out << to_text(step) << '\n';
  }
}

std::vector<Story> read_stories(std::istream& in) {
  std::vector<Story> stories;
  std::string text;
  for (size_t line = 1; std::getline(in, text); ++line) {
    try {
      read_line(text, stories);
    } catch (const std::exception& error) {
      throw std::runtime_error("line " + std::to_string(line) + ": " + error.what());
    }
  }
  return stories;
}

std::vector<Story> read_stories(const std::string& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error("cannot read " + path);
  try {
    return read_stories(in);
  } catch (const std::exception& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

}  // namespace swarmtalk::avr
