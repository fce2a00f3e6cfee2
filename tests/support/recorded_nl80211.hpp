// Answers of the kernel's 802.11 without a kernel: read from a recording (tests/vectors/nl80211),
// changed one at a time, or built from the attributes of linux/nl80211.h.
#pragma once

#include <linux/nl80211.h>
#include <netlink/genl/genl.h>
#include <netlink/msg.h>

#include <cstdint>
#include <fstream>
#include <functional>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "nl80211/asker.hpp"

namespace swarmtalk::nl80211 {

/// Lines "answer COMMAND ERROR" and, behind each, "message HEX" for each of its messages.
class RecordedAsker final : public Asker {
 public:
  RecordedAsker() = default;
  explicit RecordedAsker(const std::string& path) {
    std::ifstream file(path);
    if (!file) throw std::runtime_error("no recording " + path);
    int command = 0;
    for (std::string line; std::getline(file, line);) {
      std::istringstream words(line);
      std::string word;
      words >> word;
      if (word == "answer") {
        words >> command >> answers[command].error;
      } else if (word == "message") {
        words >> word;
        std::vector<std::uint8_t>& bytes = answers[command].messages.emplace_back();
        for (std::size_t i = 0; i + 1 < word.size(); i += 2) {
          bytes.push_back(static_cast<std::uint8_t>(std::stoi(word.substr(i, 2), nullptr, 16)));
        }
      }
    }
  }

  Answer ask(const Question& question) override {
    questions.push_back(question);
    const auto found = answers.find(question.command);
    return found == answers.end() ? Answer{ENODEV, {}} : found->second;
  }

  std::map<int, Answer> answers;  // by NL80211_CMD_GET_...
  std::vector<Question> questions;
};

/// One message of the kernel's, with the attributes that `fill` puts in.
inline std::vector<std::uint8_t> built_message(int command,
                                               const std::function<void(nl_msg*)>& fill) {
  nl_msg* message = nlmsg_alloc();
  genlmsg_put(message, 0, 0, 30, 0, 0, static_cast<std::uint8_t>(command), 1);
  fill(message);
  const nlmsghdr* header = nlmsg_hdr(message);
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(header);
  std::vector<std::uint8_t> copy(bytes, bytes + header->nlmsg_len);
  nlmsg_free(message);
  return copy;
}

}  // namespace swarmtalk::nl80211
