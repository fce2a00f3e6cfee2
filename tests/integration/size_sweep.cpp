// Sends a message of every size and waits until the other robot has heard it intact.
//   size_sweep receive    answers each message with its size and checksum, until it is ended
//   size_sweep send       sends 0 .. maximum bytes in turn; exit code 0 when all came back right
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <swarmtalk/client.hpp>

namespace {

using namespace std::chrono_literals;

struct Answer {
  std::uint32_t size_bytes = 0;
  std::uint32_t checksum = 0;
};

// FNV-1a: any changed, moved or missing byte changes it.
std::uint32_t checksum(const std::string& bytes) {
  std::uint32_t hash = 2166136261u;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619u;
  return hash;
}

// Other bytes for each size, zeros among them.
std::string message_of(std::size_t size_bytes) {
  std::string bytes(size_bytes, '\0');
  std::uint32_t state = static_cast<std::uint32_t>(size_bytes) * 2654435761u + 1;
  for (char& c : bytes) {
    state = state * 1664525u + 1013904223u;
    c = static_cast<char>(state >> 24);
  }
  return bytes;
}

int receive() {
  auto robot = swarmtalk::Client::connected("size_sweep");
  auto answers = robot.channel("size-answers").publisher();
  auto sizes = robot.channel("sizes").subscriber([&](const swarmtalk::Message& message) {
    const Answer answer{static_cast<std::uint32_t>(message.payload.size()),
                        checksum(message.payload)};
    if (!answers.send(answer)) std::fprintf(stderr, "an answer could not be sent\n");
  });
  robot.run();
  return 0;
}

int send() {
  auto robot = swarmtalk::Client::connected("size_sweep");
  auto publisher = robot.advertise("sizes", swarmtalk::Sending::one_at_a_time());
  std::optional<Answer> got;
  auto answers = robot.channel("size-answers").subscriber([&](const swarmtalk::Message& message) {
    got = message.as<Answer>();
  });
  // The receiver may still be starting: ask until it answers.
  for (int attempt = 0; attempt < 100 && !got; ++attempt) {
    (void)publisher.send("hello?");
    robot.run_for(50ms);
  }
  if (!got) {
    std::fprintf(stderr, "no receiver\n");
    return 1;
  }
  robot.run_for(100ms);  // answers to the questions before
  const std::size_t maximum = publisher.max_message_bytes();
  for (std::size_t size = 0; size <= maximum; ++size) {
    const std::string message = message_of(size);
    got.reset();
    const swarmtalk::Status status = publisher.send(message);
    if (!status) {
      std::fprintf(stderr, "%zu bytes: %s\n", size, std::string(status.text()).c_str());
      return 1;
    }
    const auto deadline = std::chrono::steady_clock::now() + 1min;
    while ((!got || publisher.busy()) && std::chrono::steady_clock::now() < deadline) {
      robot.run_once(100ms);
    }
    if (!got || got->size_bytes != size || got->checksum != checksum(message)) {
      std::fprintf(stderr, "%zu bytes: %s\n", size, got ? "arrived damaged" : "did not arrive");
      return 1;
    }
  }
  std::printf("%zu sizes, 0 to %zu bytes, all intact\n", maximum + 1, maximum);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc == 2 && std::strcmp(argv[1], "receive") == 0) return receive();
    if (argc == 2 && std::strcmp(argv[1], "send") == 0) return send();
  } catch (const swarmtalk::Error& error) {
    std::fprintf(stderr, "size_sweep: %s\n", error.what());
    return 1;
  }
  std::fprintf(stderr, "usage: size_sweep send|receive\n");
  return 2;
}
