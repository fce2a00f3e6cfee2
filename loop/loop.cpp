#include "loop/loop.hpp"

#include <unistd.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <cerrno>
#include <system_error>
#include <utility>

#include "loop/asio_poll.hpp"

namespace swarmtalk::loop {

Loop::Drive::Drive(Loop& loop) : loop_(loop), work_(boost::asio::make_work_guard(loop.io_)) {
  loop_.nested_.reset();
  loop_.is_nested_ = false;
  loop_.is_driven_ = true;
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.ptr = &loop_;
  epoll_ctl(loop_.epoll_, EPOLL_CTL_ADD, loop_.asio_, &event);
}

Loop::Drive::~Drive() {
  epoll_ctl(loop_.epoll_, EPOLL_CTL_DEL, loop_.asio_, nullptr);
  loop_.is_driven_ = false;
  loop_.wait_by_asio();
  loop_.run_by_asio();
}

void Loop::Drive::poll() {
  do {
    loop_.io_.restart();
    loop_.io_.poll();
    loop_.turn(0);
  } while (loop_.end_ > 0 || loop_.has_deferred());
}

Loop::Loop(boost::asio::execution_context& context)
    : boost::asio::execution_context::service(context),
      io_(static_cast<boost::asio::io_context&>(context)),
      asio_(poll_descriptor(io_)),
      epoll_(opened(epoll_create1(EPOLL_CLOEXEC))) {}

Loop::~Loop() {
  ::close(epoll_);
}

void Loop::shutdown() {
  kept_.clear();
  nested_.reset();
}

void Loop::run() {
  const Drive drive(*this);
  io_.poll();  // what was posted before
  while (!io_.stopped()) turn(has_deferred() ? 0 : -1);
}

void Loop::poll() {
  Drive(*this).poll();
}

void Loop::turn(int timeout_ms) {
  due_.insert(due_.end(), next_.begin(), next_.end());
  next_.clear();
  dispatch(wait(timeout_ms));
  for (int round = 0; round < kRounds && run_deferred(); ++round) {
  }
}

int Loop::wait(int timeout_ms) {
  const int count = epoll_wait(epoll_, events_.data(), kEvents, timeout_ms);
  if (count >= 0) return count;
  if (errno == EINTR) return 0;  // a signal: whoever waits for it is told
  throw std::system_error(errno, std::system_category(), "the event loop cannot wait");
}

void Loop::dispatch(int count) {
  bool has_asio = is_driven_ && ++turns_ % kTurns == 0;
  end_ = count;
  for (at_ = 0; at_ < end_; ++at_) {
    const epoll_event event = events_[static_cast<std::size_t>(at_)];
    if (event.data.ptr == this) {
      has_asio = true;
    } else if (event.data.ptr != nullptr) {
      static_cast<Descriptor*>(event.data.ptr)->on_events_(event.events);
    }
  }
  if (has_asio && !io_.stopped()) io_.poll();
}

/// One round. @return there is another one to do
bool Loop::run_deferred() {
  running_.swap(due_);
  for (std::size_t i = 0; i < running_.size(); ++i) {  // forget() may empty a place
    Deferred* const work = std::exchange(running_[i], nullptr);
    if (work == nullptr) continue;
    work->is_due_ = false;
    work->work_();
  }
  running_.clear();
  const std::vector<std::shared_ptr<void>> ended = std::exchange(kept_, {});
  return !due_.empty();
}

void Loop::change(Descriptor& descriptor, std::uint32_t events) {
  epoll_event event{};
  event.events = events;
  event.data.ptr = &descriptor;
  const int action = descriptor.watched_ == 0 ? EPOLL_CTL_ADD
                     : events == 0            ? EPOLL_CTL_DEL
                                              : EPOLL_CTL_MOD;
  if (epoll_ctl(epoll_, action, descriptor.fd_, &event) != 0) {
    throw std::system_error(errno, std::system_category(), "cannot watch a descriptor");
  }
  if (action == EPOLL_CTL_ADD) ++watched_;
  if (action == EPOLL_CTL_DEL) {
    --watched_;
    forget(descriptor);
  }
  descriptor.watched_ = events;
  wait_by_asio();
}

/// Events that are in hand would be told to something that is gone.
void Loop::forget(Descriptor& descriptor) {
  for (int i = at_; i < end_; ++i) {
    epoll_event& event = events_[static_cast<std::size_t>(i)];
    if (event.data.ptr == &descriptor) event.data.ptr = nullptr;
  }
}

void Loop::defer(Deferred& work, std::vector<Deferred*>& queue) {
  work.is_due_ = true;
  queue.push_back(&work);
  run_by_asio();
}

void Loop::forget(Deferred& work) {
  for (auto* queue : {&due_, &next_, &running_}) {
    std::replace(queue->begin(), queue->end(), &work, static_cast<Deferred*>(nullptr));
  }
  work.is_due_ = false;
}

void Loop::keep(std::shared_ptr<void> object) {
  kept_.push_back(std::move(object));
  run_by_asio();
}

void Loop::wait_by_asio() {
  if (is_driven_) return;
  if (watched_ == 0) {
    nested_.reset();  // nothing to wait for
    is_nested_ = false;
    return;
  }
  if (std::exchange(is_nested_, true)) return;
  if (!nested_) nested_.emplace(io_, opened(dup(epoll_)));
  nested_->async_wait(boost::asio::posix::stream_descriptor::wait_read,
                      [this](const boost::system::error_code& error) {
                        if (error || is_driven_) return;
                        is_nested_ = false;
                        dispatch(wait(0));
                        wait_by_asio();
                      });
}

void Loop::run_by_asio() {
  if (is_driven_ || !has_deferred() || std::exchange(is_posted_, true)) return;
  boost::asio::post(io_, [this] {
    is_posted_ = false;
    if (is_driven_) return;
    due_.insert(due_.end(), next_.begin(), next_.end());
    next_.clear();
    run_deferred();
    run_by_asio();
  });
}

void Descriptor::close() {
  if (fd_ < 0) return;
  watch(0);
  ::close(fd_);
  fd_ = -1;
}

}  // namespace swarmtalk::loop
