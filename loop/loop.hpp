// Loop: waits for the descriptors that each message passes, and joins what follows from them in one
// turn. Asio arms a descriptor anew after each wake-up and looks for events before it runs what was
// posted: two system calls that a message need not cost. Everything else (timers, signals, serial
// lines) stays with the io_context, which the loop runs when it has something. One thread.
//
// A service of the io_context: Loop::of(io). While somebody runs the io_context itself, as tests
// do, the same work is done from there, with the calls that this saves.
#pragma once

#include <sys/epoll.h>

#include <array>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace swarmtalk::loop {

class Descriptor;
class Deferred;

class Loop final : public boost::asio::execution_context::service {
 public:
  using key_type = Loop;
  inline static boost::asio::execution_context::id id;

  /// Of use_service(). @throws std::system_error  out of descriptors
  explicit Loop(boost::asio::execution_context& context);
  ~Loop() override;

  static Loop& of(boost::asio::io_context& io) { return boost::asio::use_service<Loop>(io); }

  /// While it lives the loop waits for the io_context, and not the other way round: for who looks
  /// again and again.
  class Drive {
   public:
    explicit Drive(Loop& loop);
    ~Drive();
    Drive(const Drive&) = delete;
    Drive& operator=(const Drive&) = delete;

    /// As Loop::poll().
    void poll();
    /// A part of that: what is ready now.
    void turn() { loop_.turn(0); }

   private:
    Loop& loop_;
    boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_;
  };

  /// Until io.stop().
  void run();
  /// All that is ready, and what follows from it. Waits for nothing.
  void poll();

  /// Readable while something is ready, for who waits for several loops. Not what has_work() says.
  int descriptor() const { return epoll_; }
  /// There is something to do that nothing has to be waited for.
  bool has_work() const { return has_deferred(); }

  /// Kept until the end of the turn: for an object that ends inside one of its own functions.
  void keep(std::shared_ptr<void> object);

 private:
  friend class Descriptor;
  friend class Deferred;

  static constexpr int kEvents = 64;
  static constexpr int kRounds = 4;        // of deferred work in a turn
  static constexpr unsigned kTurns = 256;  // at most, without a look at the io_context

  void shutdown() override;
  void turn(int timeout_ms);
  int wait(int timeout_ms);
  void dispatch(int count);
  bool run_deferred();
  bool has_deferred() const { return !due_.empty() || !next_.empty() || !kept_.empty(); }

  void change(Descriptor& descriptor, std::uint32_t events);
  void forget(Descriptor& descriptor);
  void defer(Deferred& work, std::vector<Deferred*>& queue);
  void forget(Deferred& work);
  /// Through the io_context, when nobody drives the loop.
  void wait_by_asio();
  void run_by_asio();

  boost::asio::io_context& io_;
  int asio_ = -1;  // the descriptor on which io_ waits
  int epoll_ = -1;
  std::optional<boost::asio::posix::stream_descriptor> nested_;  // epoll_, while not driven
  bool is_driven_ = false;                                       // run() or poll() is on the stack
  bool is_nested_ = false;                                       // nested_ is waited for
  bool is_posted_ = false;                                       // run_by_asio() is
  std::size_t watched_ = 0;
  unsigned turns_ = 0;
  std::array<epoll_event, kEvents> events_{};
  int at_ = 0;                   // event in hand
  int end_ = 0;                  // of events_
  std::vector<Deferred*> due_;   // this turn
  std::vector<Deferred*> next_;  // behind the next look for events
  std::vector<Deferred*> running_;
  std::vector<std::shared_ptr<void>> kept_;
};

/// An open descriptor that the loop watches; closed with it.
class Descriptor {
 public:
  /// @param on_events  gets what epoll says: EPOLLIN, EPOLLOUT, EPOLLHUP, EPOLLERR
  Descriptor(Loop& loop, std::function<void(std::uint32_t)> on_events)
      : loop_(loop), on_events_(std::move(on_events)) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  /// Takes over an open descriptor, the only one until close().
  void own(int descriptor) { fd_ = descriptor; }
  int fd() const { return fd_; }

  /// From now on these events are waited for, until another call: nothing is armed anew. 0: none.
  void watch(std::uint32_t events) {
    if (events != watched_) loop_.change(*this, events);
  }
  std::uint32_t watched() const { return watched_; }
  void close();

 private:
  friend class Loop;

  Loop& loop_;
  std::function<void(std::uint32_t)> on_events_;
  int fd_ = -1;
  std::uint32_t watched_ = 0;
};

/// Work of an object that is done once for all that asks for it in a turn. Forgotten with it.
class Deferred {
 public:
  Deferred(Loop& loop, std::function<void()> work) : loop_(loop), work_(std::move(work)) {}
  ~Deferred() {
    if (is_due_) loop_.forget(*this);
  }
  Deferred(const Deferred&) = delete;
  Deferred& operator=(const Deferred&) = delete;

  /// At the end of this turn, behind what was asked for before.
  void at_end() {
    if (!is_due_) loop_.defer(*this, loop_.due_);
  }
  /// In the next turn, behind all that is ready by then.
  void next_turn() {
    if (!is_due_) loop_.defer(*this, loop_.next_);
  }
  bool is_due() const { return is_due_; }

 private:
  friend class Loop;

  Loop& loop_;
  std::function<void()> work_;
  bool is_due_ = false;
};

}  // namespace swarmtalk::loop
