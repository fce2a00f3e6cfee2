// Client: one program's connection to the swarmtalkd of its robot. It reconnects and re-registers
// by itself. One thread, the caller's, owns a Client and all it hands out: callbacks run there,
// inside process() and run*(), and nowhere else. Other threads may call stop() and
// Publisher::send().
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <swarmtalk/client/channel.hpp>
#include <swarmtalk/client/daemon_status.hpp>
#include <swarmtalk/client/message.hpp>
#include <swarmtalk/client/status.hpp>

namespace swarmtalk {

/// What a Client is made with; the defaults are good.
struct ClientOptions {
  std::string socket_path;  // empty: $SWARMTALK_SOCKET, else /run/swarmtalk/swarmtalkd.sock
  std::chrono::milliseconds connect_timeout{2000};
  std::chrono::milliseconds request_timeout{1000};  // for calls that wait for the daemon's answer
  std::chrono::milliseconds reconnect_first{20};    // doubled after each failure, with jitter,
  std::chrono::milliseconds reconnect_max{250};     // up to this
};

/// One program's connection to the daemon of its robot.
class Client {
 public:
  /// Does not connect yet: connect() does, or else the first publisher(), subscriber(), process().
  /// @param name  of the program, for the daemon's log and status; UTF-8, 1 to 1024 bytes, else
  ///   connect() answers kBadArgument
  /// @throws std::system_error when the process is out of file descriptors
  explicit Client(std::string_view name, ClientOptions options = {});
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  ~Client();

  /// A connected client. @throws Error with the Status of connect()
  static Client connected(std::string_view name, ClientOptions options = {});

  /// Waits until connected and registered, at most ClientOptions::connect_timeout; runs no
  /// callback.
  /// @return kNoDaemon, kDaemonDead, kNoPermission, kVersionMismatch, kTimeout, kBadArgument,
  ///   kSystem. After a failure process() and run*() go on trying.
  [[nodiscard]] Status connect();
  /// Whether there is a daemon now.
  bool is_connected() const;

  /// By name, UTF-8: the daemon's [channels] table gives the number, or a hash of the name does.
  /// The handles made of an impossible name or number say so: kBadChannel.
  Channel channel(std::string_view name, ChannelOptions options = {});
  /// The same for a literal.
  Channel channel(const char* name, ChannelOptions options = {}) {
    return channel(std::string_view(name), options);
  }
  /// By number, 0 to 65535 (0 to 15 on Kilobots).
  Channel channel(int number, ChannelOptions options = {});

  /// Short for channel(...).subscriber(...): robot.subscribe("alarm", Policy::latest(), receive).
  Subscriber subscribe(std::string_view channel_name, Policy policy, ReceiveCallback receive) {
    return channel(channel_name).subscriber(std::move(receive), policy);
  }
  /// The same without a policy.
  Subscriber subscribe(std::string_view channel_name, ReceiveCallback receive) {
    return channel(channel_name).subscriber(std::move(receive));
  }
  /// Short for channel(...).publisher(...): robot.advertise("alarm", Sending::newest(4)).
  Publisher advertise(std::string_view channel_name, Sending sending = {}, SentCallback sent = {}) {
    return channel(channel_name).publisher(std::move(sent), sending);
  }

  /// Tells the daemon where this robot is now; the pose ages from here. Never blocks, except that
  /// it connects first, as connect() does, when nothing else has yet. While 64 poses have no
  /// answer, the newest waits and replaces the one that waited.
  /// @param theta_rad  counter-clockwise from +x, in radians; more than a whole turn, as with
  ///   degrees, is taken without its whole turns, and told once on stderr
  /// @return kBadPose (also to on_error); kDisconnected
  Status set_pose(float x_m, float y_m, float theta_rad);
  /// The same for a robot that stands still: the pose does not age, until another is set.
  Status set_fixed_pose(float x_m, float y_m, float theta_rad);

  /// Sends a line to whoever listens to the reserved channel "debug" (`swarmtalk-cli log`), over a
  /// few hops. Never waits; the daemon counts lines beyond its `rate_hz`. The first call registers.
  /// @return as Publisher::send(); kBadChannel where the daemon's configuration has it off
  Status log(std::string_view line);

  /// Asks the daemon; waits for the answer, at most ClientOptions::request_timeout; runs no
  /// callback.
  [[nodiscard]] Status get_status(DaemonStatus& status);
  /// The robots heard within the last 10 s, by link and node id.
  [[nodiscard]] Status get_neighbours(std::vector<Neighbour>& neighbours);
  /// `pose` is empty when the robot has no valid pose.
  [[nodiscard]] Status get_pose(std::optional<Pose>& pose);
  /// Waits until the daemon has answered everything asked so far (set_pose, destroyed handles).
  /// @return the first refusal since the last sync(), kTimeout or kDisconnected
  [[nodiscard]] Status sync();

  /// Node id of this robot, 0 before the first connection. With an automatic id it may change
  /// later: get_status() tells the present one.
  std::uint32_t node_id() const;
  /// Name and version of the daemon, as it says.
  std::string daemon_name() const;

  /// For an event loop of your own: readable when process() has work. Stays the same, and stays
  /// valid, for the life of the Client, also while there is no daemon. Do not read or close it.
  int fd() const;
  /// Does everything that waits: reads, calls callbacks, reconnects. Never blocks.
  /// @return kDisconnected while there is no daemon
  Status process();

  /// process() in a loop: for ever, for a time, or until stop().
  /// @return kOk; kBadArgument when called inside a callback, or while another thread is inside
  Status run();
  /// The same for a time, or until stop().
  Status run_for(std::chrono::nanoseconds duration);
  /// Waits for something to do, at most `timeout`, and does it once.
  Status run_once(std::chrono::nanoseconds timeout);
  /// Makes the running run*(), or else the next one, return. Any thread, also a signal handler.
  void stop();

  /// Each replaces a default that writes one line to stderr; an empty function silences it.
  /// Lost connection: called once for each loss, before anything else happens on it.
  void on_disconnect(std::function<void(const Status&)> callback);
  /// Connected again and everything re-registered.
  void on_reconnect(std::function<void()> callback);
  /// Messages were lost: called before the callback of a message whose `lost_before` is not empty,
  /// with that message. No default.
  void on_gap(std::function<void(const Message&)> callback);
  /// Errors that no return value can tell, and those that a program should not overlook.
  void on_error(std::function<void(const Status&)> callback);

 private:
  std::shared_ptr<client::Engine> session_;
};

}  // namespace swarmtalk
