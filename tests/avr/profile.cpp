#include "tests/avr/profile.hpp"

#include <algorithm>
#include <cstdio>
#include <map>
#include <sstream>
#include <vector>

namespace swarmtalk::avr {
namespace {

constexpr size_t kMostRows = 30;

std::string output_of(const std::string& command) {
  FILE* const pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) throw std::runtime_error("cannot run " + command);
  std::string text;
  char buffer[4096];
  for (size_t read = 0; (read = std::fread(buffer, 1, sizeof buffer, pipe)) != 0;) {
    text.append(buffer, read);
  }
  if (pclose(pipe) != 0) throw std::runtime_error("this failed: " + command);
  return text;
}

std::string without(std::string text, const std::string& part) {
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part)) {
    text.erase(at, part.size());
  }
  return text;
}
std::string plain_name(std::string name) {
  for (const char* part : {"swarmtalk::core::", "<Kilobot>", "(anonymous namespace)::"}) {
    name = without(name, part);
  }
  return name.substr(0, name.find(" [clone"));
}

/// Functions by their first address.
std::map<uint32_t, std::string> functions_of(const std::string& image) {
  std::map<uint32_t, std::string> functions;
  std::istringstream lines(output_of("avr-nm -nC '" + image + "'"));
  for (std::string line; std::getline(lines, line);) {
    if (line.size() < 12 || std::string("tTwW").find(line[9]) == std::string::npos) continue;
    const std::string name = plain_name(line.substr(11));
    if (name == "__stack") continue;  // an address in RAM
    functions[static_cast<uint32_t>(std::stoul(line.substr(0, 8), nullptr, 16))] = name;
  }
  if (functions.empty()) throw std::runtime_error(image + " has no symbols");
  return functions;
}

struct Cost {
  uint32_t alone = 0;
  uint32_t with_callees = 0;
  uint32_t calls = 0;
};

/// Adds up instructions in the order in which they ran.
class CycleProfile {
 public:
  explicit CycleProfile(std::map<uint32_t, std::string> functions)
      : functions_(std::move(functions)) {}

  void add(uint32_t pc, uint32_t cycles) {
    total_ += cycles;
    lines_[pc] += cycles;
    const uint32_t function = std::prev(functions_.upper_bound(pc))->first;
    const auto open = std::find(stack_.begin(), stack_.end(), function);
    if (open == stack_.end()) {
      stack_.push_back(function);
      ++costs_[function].calls;
    } else {
      stack_.erase(open + 1, stack_.end());
      if (pc == function) ++costs_[function].calls;
    }
    costs_[function].alone += cycles;
    for (const uint32_t caller : stack_) costs_[caller].with_callees += cycles;
  }

  void print(const std::string& image) const {
    std::printf("%u cycles, by function:\n alone  with callees  calls\n", total_);
    std::vector<std::pair<uint32_t, Cost>> rows(costs_.begin(), costs_.end());
    std::stable_sort(rows.begin(), rows.end(),
                     [](const auto& a, const auto& b) { return a.second.alone > b.second.alone; });
    for (const auto& [function, cost] : rows) {
      std::printf("%6u  %12u  %5u  %s\n", cost.alone, cost.with_callees, cost.calls,
                  functions_.at(function).c_str());
    }
    print_lines(image);
  }

 private:
  void print_lines(const std::string& image) const {
    std::ostringstream command;
    command << "avr-addr2line -e '" << image << "'" << std::hex;
    for (const auto& [pc, cycles] : lines_) command << ' ' << pc;
    std::istringstream places(output_of(command.str()));
    std::map<std::string, uint32_t> by_line;
    for (const auto& [pc, cycles] : lines_) {
      std::string place;
      std::getline(places, place);
      place = place.substr(place.rfind('/') + 1);
      by_line[place.substr(0, place.find(" (disc"))] += cycles;
    }
    std::vector<std::pair<std::string, uint32_t>> rows(by_line.begin(), by_line.end());
    std::stable_sort(rows.begin(), rows.end(),
                     [](const auto& a, const auto& b) { return a.second > b.second; });
    if (rows.size() > kMostRows) rows.resize(kMostRows);
    std::printf("by source line, the first %zu:\n", rows.size());
    for (const auto& [place, cycles] : rows) std::printf("%6u  %s\n", cycles, place.c_str());
  }

  std::map<uint32_t, std::string> functions_;
  std::map<uint32_t, Cost> costs_;
  std::map<uint32_t, uint32_t> lines_;
  std::vector<uint32_t> stack_;
  uint32_t total_ = 0;
};

}  // namespace

void print_profile(EmulatedNode& node, const std::string& image, const Story& story, bool is_pull) {
  uint32_t most = 0;
  size_t at = 0;
  EmulatedNode::State before;
  node.start(story.start);
  for (size_t i = 0; i < story.steps.size(); ++i) {
    const EmulatedNode::State here = node.save();
    node.run(story.steps[i], [&](const Call& call) {
      if (call.is_pull != is_pull || call.cycles <= most) return;
      most = call.cycles;
      at = i;
      before = here;
    });
  }
  if (most == 0) return;
  std::printf("\nstory %s, step %zu of %zu: %s\n", story.name.c_str(), at + 1, story.steps.size(),
              to_text(story.steps[at]).c_str());
  // A step may be several calls: all are profiled, the worst is printed.
  const std::map<uint32_t, std::string> functions = functions_of(image);
  CycleProfile profile(functions);
  bool is_printed = false;
  node.restore(before);
  node.watch([&](uint32_t pc, uint32_t cycles) { profile.add(pc, cycles); });
  node.run(story.steps[at], [&](const Call& call) {
    if (call.cycles == most && !is_printed) {
      profile.print(image);
      is_printed = true;
    }
    profile = CycleProfile(functions);
  });
  node.watch(nullptr);
}

}  // namespace swarmtalk::avr
