// The subcommands of swarmtalk-cli: what main() has parsed, and a function each that does it and
// returns the exit code. Errors go to stderr as one line, with the remedy.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <swarmtalk/client.hpp>

#include "cli/text/message_text.hpp"

namespace swarmtalk::cli {

inline constexpr int kExitOk = 0;
inline constexpr int kExitFailure = 1;
inline constexpr int kExitUsage = 2;
inline constexpr int kExitNoDaemon = 3;
inline constexpr int kExitTimeout = 124;
inline constexpr int kExitSignal = 128;  // plus the signal's number

/// What main() is to do, where a family of subcommands says it itself.
using Verb = std::function<int()>;

struct Common {
  std::string socket_path;
  bool is_json = false;
  bool is_verbose = false;
};

struct PubArguments {
  std::string channel;
  std::string payload;
  bool is_hex = false;
  std::uint64_t repeat = 1;  // 0: until a signal
  double rate_hz = 0;        // 0: as soon as the message before has left
  std::optional<std::uint32_t> ttl;
  bool is_timestamped = false;
  std::uint32_t copies = 1;   // each message is sent so often
  std::string redundancy;     // repair packets of each message, or "auto"; empty: none
  double timeout_s = 5;       // for each message
  bool is_lines = false;      // each line is a message
  std::string file;           // instead of the payload; empty: none
  std::string struct_format;  // the payload, or each line, are values for it; empty: none
};

struct SubArguments {
  std::vector<std::string> channels;
  std::uint64_t count = 0;  // 0: no end
  double timeout_s = 0;     // 0: no end
  Policy policy;
  double max_age_s = 0;  // 0: any
  bool is_timestamped = false;
  bool is_all = false;  // every channel, here and on the air
  LookArguments look;
};

struct HarvestArguments {
  std::string prefix;
  std::vector<std::string> values;  // KEY=VALUE: answers instead of asking
  std::uint32_t ttl = 4;
  double timeout_s = 2;  // 0: until a signal
};

struct PoseArguments {
  float x_m = 0;
  float y_m = 0;
  std::string theta;       // radians, or degrees with "deg" after them
  bool is_ageing = false;  // as a pose of a program; else it stays until another is set
};

struct LogLevelArguments {
  std::string level;      // empty: ask only
  std::string subsystem;  // empty: all
};

struct CaptureArguments {
  std::string file;
  std::string key_file;     // sealed frames are written unsealed; empty: as they are
  std::string from;         // a capture to copy; empty: from the daemon
  bool replaces = false;    // `file` may exist
  std::uint64_t count = 0;  // 0: no end
  double timeout_s = 0;     // 0: no end
};

int pub(const Common& common, const PubArguments& arguments);
int sub(const Common& common, const SubArguments& arguments);
int sub_all(const Common& common, const SubArguments& arguments, const MessageText& text);
int status(const Common& common);
int stats(const Common& common);
int neighbours(const Common& common);
int harvest(const Common& common, const HarvestArguments& arguments);
int set_pose(const Common& common, const PoseArguments& arguments);
int get_pose(const Common& common);
int reload(const Common& common);
int log_level(const Common& common, const LogLevelArguments& arguments);
/// @param id  "auto" or digits
int node_id(const Common& common, const std::string& id);
int metrics(const Common& common);
int capture(const Common& common, const CaptureArguments& arguments);
/// Makes a swarm key. @param path  of a file that must not exist
int keygen(const std::string& path);

/// Prints "swarmtalk-cli: TEXT" to stderr. @return `exit_code`
int fail(std::string_view text, int exit_code = kExitFailure);
/// The same for a Status; tells an unreachable daemon from other failures.
int fail(const Status& status);
/// The same for a screen, which ends where its client would connect again: whenever it notices, a
/// daemon that is gone is told in the same words.
int fail_of_screen(const Status& status);

/// Writes lines to stdout at once; what in them is not plain (text/plain.hpp) is escaped, whoever
/// wrote it. @return kExitOk, or else that of fail()
int print(std::string_view text);
/// The same with nothing escaped: what strangers said in it has to be plain already.
int print_as_is(std::string_view text);

/// A client that is silent by itself: the commands say what is to be said.
Client make_client(const Common& common);

/// From here on a lost and a returned daemon are told on stderr.
void tell_connection(Client& client);

/// A channel by number when `word` is digits only, else by name. A number must fit.
Channel open_channel(Client& client, const std::string& word, const ChannelOptions& options);

/// False: one of the others listens to the same channel, under this name or another.
bool is_new(const Subscriber& subscriber, const std::vector<Subscriber>& others);

/// From here on SIGINT, SIGTERM and SIGHUP stop `client`'s run*().
void stop_on_signals(Client& client);
/// The same without a client: calls that wait are interrupted.
void interrupt_on_signals();
/// One line of a program that runs until it is ended, where Ctrl-C's signal is ignored.
void tell_what_ends_a_job();
/// The signal that came, 0 for none.
int caught_signal();

}  // namespace swarmtalk::cli
