// The cycles of the library's calls on an emulated ATmega328P: how many the worst receive and the
// worst pull take that a random search over stories finds. See usage().
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/avr/emulated_node.hpp"
#include "tests/avr/profile.hpp"
#include "tests/avr/search.hpp"
#include "tests/avr/story.hpp"

namespace {

using namespace swarmtalk::avr;

/// Worst calls of each sort that are written.
constexpr size_t kKept = 2;

struct Options {
  std::string image;
  std::vector<std::string> tables;
  std::vector<std::string> learned;
  std::string shown;
  std::string profiled;
  std::string found = "cycles_found.txt";
  uint64_t calls = 0;
  uint64_t seed = 1;
  uint32_t limits[2] = {UINT32_MAX, UINT32_MAX};  // receive, pull
};

int usage() {
  std::fputs(
      "usage: avr_cycles IMAGE.elf [option...]\n"
      "  --limits RECEIVE PULL   exit 1 if a call takes more cycles\n"
      "  --table FILE            the stories' named calls as a table\n"
      "  --replay FILE           the worst of these stories; the search goes on from them\n"
      "  --search CALLS          random search until so many calls have been measured\n"
      "  --seed NUMBER           of the search\n"
      "  --found FILE            where the worst stories are written (cycles_found.txt)\n"
      "  --show FILE             each step of these stories and its cycles, nothing else\n"
      "  --profile FILE          where the cycles of the worst receive and pull go, nothing else\n",
      stderr);
  return 2;
}

std::optional<Options> read_options(const std::vector<std::string>& words) {
  if (words.empty()) return std::nullopt;
  Options options;
  options.image = words[0];
  for (size_t i = 1; i < words.size(); ++i) {
    const std::string& word = words[i];
    const size_t values = word == "--limits" ? 2 : 1;
    if (i + values >= words.size()) return std::nullopt;
    const std::string& value = words[i + 1];
    if (word == "--limits") {
      for (int n = 0; n < 2; ++n) {
        options.limits[n] =
            static_cast<uint32_t>(std::stoul(words[i + 1 + static_cast<size_t>(n)]));
      }
    } else if (word == "--table") {
      options.tables.push_back(value);
    } else if (word == "--replay") {
      options.learned.push_back(value);
    } else if (word == "--search") {
      options.calls = std::stoull(value);
    } else if (word == "--seed") {
      options.seed = std::stoull(value);
    } else if (word == "--found") {
      options.found = value;
    } else if (word == "--profile") {
      options.profiled = value;
    } else if (word == "--show") {
      options.shown = value;
    } else {
      return std::nullopt;
    }
    i += values;
  }
  return options;
}

void print_line(uint32_t cycles, const std::string& what, bool is_over) {
  std::printf("%6u cycles  %s%s\n", cycles, what.c_str(), is_over ? "  OVER BUDGET" : "");
}

/// @return whether all calls were within their limits
bool print_table(EmulatedNode& node, const Story& story, const Options& options) {
  std::vector<std::string> order;
  std::map<std::string, std::pair<uint32_t, bool>> rows;  // most cycles, whether over its limit
  node.start(story.start);
  for (const Step& step : story.steps) {
    const std::string& label = story.labels[step.label];
    node.run(step, [&](const Call& call) {
      if (label.empty()) return;
      if (rows.count(label) == 0) order.push_back(label);
      auto& [most, is_over] = rows[label];
      most = std::max(most, call.cycles);
      is_over = is_over || call.cycles > options.limits[call.is_pull];
    });
  }
  bool is_well = !order.empty();
  for (const std::string& label : order) {
    const auto& [most, is_over] = rows[label];
    print_line(most, label, is_over);
    is_well = is_well && !is_over;
  }
  return is_well;
}

void show(EmulatedNode& node, const Story& story) {
  std::printf("story %s\n", story.name.c_str());
  node.start(story.start);
  for (const Step& step : story.steps) {
    std::string cycles;
    uint32_t most[2] = {0, 0};
    node.run(step, [&](const Call& call) {
      most[call.is_pull] = std::max(most[call.is_pull], call.cycles);
    });
    std::printf("%6u  %s\n", std::max(most[0], most[1]), to_text(step).c_str());
  }
}

/// Most cycles of a receive or pull of a story.
uint32_t worst_of(EmulatedNode& node, const Story& story, bool is_pull) {
  uint32_t most = 0;
  node.start(story.start);
  for (const Step& step : story.steps) {
    node.run(step, [&](const Call& call) {
      if (call.is_pull == is_pull) most = std::max(most, call.cycles);
    });
  }
  return most;
}

/// Of the worst receive and the worst pull of all stories.
void profile(EmulatedNode& node, const Options& options) {
  const std::vector<Story> stories = read_stories(options.profiled);
  for (const bool is_pull : {false, true}) {
    const Story* worst = nullptr;
    uint32_t most = 0;
    for (const Story& story : stories) {
      const uint32_t cycles = worst_of(node, story, is_pull);
      if (cycles > most) worst = &story;
      most = std::max(most, cycles);
    }
    if (worst != nullptr) print_profile(node, options.image, *worst, is_pull);
  }
}

const char* sort_of(bool is_pull) {
  return is_pull ? "pull" : "receive";
}

/// Writes what was found, reads it again and tells it from a reset: it must come to the same.
bool write_finds(EmulatedNode& node, const std::vector<Find>& finds, const Options& options) {
  {
    std::ofstream out(options.found);
    out << "# Written by avr_cycles --search " << options.calls << " --seed " << options.seed
        << ": the worst calls that it found,\n# each the last step of its story.\n";
    for (const Find& find : finds) write(out, find.story);
    if (!out.flush()) {
      std::fprintf(stderr, "avr_cycles: cannot write %s\n", options.found.c_str());
      return false;
    }
  }
  const std::vector<Story> stories = read_stories(options.found);
  for (size_t i = 0; i < finds.size(); ++i) {
    uint32_t last = 0;
    node.start(stories.at(i).start);
    for (const Step& step : stories[i].steps) {
      last = 0;
      node.run(step, [&](const Call& call) { last = std::max(last, call.cycles); });
    }
    if (last != finds[i].cycles) {
      std::fprintf(stderr, "avr_cycles: %s took %u cycles, and %u when told again\n",
                   stories[i].name.c_str(), finds[i].cycles, last);
      return false;
    }
  }
  return true;
}

bool search(EmulatedNode& node, const Options& options) {
  Search search(node, options.seed, [](bool is_pull, uint32_t cycles, uint64_t calls) {
    std::printf("after %llu calls: %s %u\n", static_cast<unsigned long long>(calls),
                sort_of(is_pull), cycles);
    std::fflush(stdout);
  });
  try {
    for (const std::string& file : options.learned) {
      for (const Story& story : read_stories(file)) search.learn(story);
    }
    search.run(options.calls);
  } catch (const std::exception&) {
    std::ofstream out(options.found);
    write(out, search.present());
    std::fprintf(stderr, "avr_cycles: seed %llu; the last step of %s:\n",
                 static_cast<unsigned long long>(options.seed), options.found.c_str());
    throw;
  }
  const uint64_t calls = search.calls();
  bool is_well = true;
  std::vector<Find> finds;
  for (const bool is_pull : {false, true}) {
    for (const bool is_drawn : {false, true}) {
      const size_t known = finds.size();
      for (Find find : search.worst(is_pull, is_drawn, kKept)) {
        find = search.shorten(find, is_pull);
        find.story.name = std::string(sort_of(is_pull)) + "-" + std::to_string(find.cycles);
        finds.push_back(std::move(find));
      }
      if (finds.size() == known) continue;
      const uint32_t cycles = finds[known].cycles;
      const bool is_over = cycles > options.limits[is_pull];
      print_line(cycles,
                 std::string(sort_of(is_pull)) + ", worst of " + std::to_string(calls) +
                     " random calls, " + (is_drawn ? "id drawn" : "id fixed"),
                 is_over);
      is_well = is_well && !is_over;
    }
  }
  is_well = write_finds(node, finds, options) && is_well;
  std::printf("seed %llu; each step of the worst: avr_cycles %s --show %s\n",
              static_cast<unsigned long long>(options.seed), options.image.c_str(),
              options.found.c_str());
  return is_well;
}

int run(const Options& options) {
  EmulatedNode node(options.image);
  if (!options.shown.empty()) {
    for (const Story& story : read_stories(options.shown)) show(node, story);
    return 0;
  }
  if (!options.profiled.empty()) {
    profile(node, options);
    return 0;
  }
  bool is_well = true;
  for (const std::string& table : options.tables) {
    for (const Story& story : read_stories(table)) {
      is_well = print_table(node, story, options) && is_well;
    }
  }
  if (options.calls != 0 || !options.learned.empty()) is_well = search(node, options) && is_well;
  return is_well ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::optional<Options> options =
        read_options(std::vector<std::string>(argv + 1, argv + argc));
    return options ? run(*options) : usage();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "avr_cycles: %s\n", error.what());
    return 2;
  }
}
