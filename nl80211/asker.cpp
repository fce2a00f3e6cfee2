#include "nl80211/asker.hpp"

#include <linux/nl80211.h>
#include <netlink/errno.h>
#include <netlink/genl/ctrl.h>
#include <netlink/genl/genl.h>
#include <netlink/msg.h>
#include <netlink/netlink.h>
#include <sys/socket.h>
#include <sys/time.h>

#include <cerrno>

namespace swarmtalk::nl80211 {
namespace {

constexpr std::size_t kMostMessages = 4096;  // of one answer: stations, or networks in range
constexpr int kMostReads = 4096;

struct MessageFreer {
  void operator()(nl_msg* message) const { nlmsg_free(message); }
};
struct CallbackFreer {
  void operator()(nl_cb* callbacks) const { nl_cb_put(callbacks); }
};

struct Reading {
  Answer answer;
  bool is_over = false;
};

int on_message(nl_msg* message, void* argument) {
  auto& reading = *static_cast<Reading*>(argument);
  const nlmsghdr* header = nlmsg_hdr(message);
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(header);
  if (reading.answer.messages.size() < kMostMessages) {
    reading.answer.messages.emplace_back(bytes, bytes + header->nlmsg_len);
  }
  return NL_OK;
}

int on_end(nl_msg*, void* argument) {
  static_cast<Reading*>(argument)->is_over = true;
  return NL_STOP;
}

int on_error(sockaddr_nl*, nlmsgerr* error, void* argument) {
  auto& reading = *static_cast<Reading*>(argument);
  reading.answer.error = -error->error;
  reading.is_over = true;
  return NL_STOP;
}

bool fill(nl_msg* message, int family, const Question& question) {
  const int flags = question.is_dump ? NLM_F_DUMP : NLM_F_ACK;
  if (genlmsg_put(message, NL_AUTO_PORT, NL_AUTO_SEQ, family, 0, flags, question.command, 0) ==
      nullptr) {
    return false;
  }
  if (question.interface != 0 &&
      nla_put_u32(message, NL80211_ATTR_IFINDEX, question.interface) != 0) {
    return false;
  }
  for (const Question::Value& each : question.values) {
    if (nla_put(message, each.attribute, static_cast<int>(each.bytes.size()), each.bytes.data()) !=
        0) {
      return false;
    }
  }
  return true;
}

}  // namespace

void KernelAsker::Closer::operator()(nl_sock* socket) const {
  nl_socket_free(socket);
}

KernelAsker::KernelAsker() : socket_(nl_socket_alloc()) {
  if (socket_ == nullptr || genl_connect(socket_.get()) != 0) return;
  const timeval timeout{0, kAnswerTimeoutMs * 1000};
  setsockopt(nl_socket_get_fd(socket_.get()), SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
  family_ = genl_ctrl_resolve(socket_.get(), NL80211_GENL_NAME);
}

KernelAsker::~KernelAsker() = default;

Answer KernelAsker::ask(const Question& question) {
  Reading reading;
  reading.answer.error = EOPNOTSUPP;
  if (!is_there()) return reading.answer;
  const std::unique_ptr<nl_msg, MessageFreer> message(nlmsg_alloc());
  const std::unique_ptr<nl_cb, CallbackFreer> callbacks(nl_cb_alloc(NL_CB_DEFAULT));
  reading.answer.error = ENOMEM;
  if (message == nullptr || callbacks == nullptr || !fill(message.get(), family_, question)) {
    return reading.answer;
  }
  reading.answer.error = 0;
  nl_cb_set(callbacks.get(), NL_CB_VALID, NL_CB_CUSTOM, on_message, &reading);
  nl_cb_set(callbacks.get(), NL_CB_FINISH, NL_CB_CUSTOM, on_end, &reading);
  nl_cb_set(callbacks.get(), NL_CB_ACK, NL_CB_CUSTOM, on_end, &reading);
  nl_cb_err(callbacks.get(), NL_CB_CUSTOM, on_error, &reading);
  if (nl_send_auto(socket_.get(), message.get()) < 0) {
    reading.answer.error = EIO;
    return reading.answer;
  }
  for (int i = 0; i < kMostReads && !reading.is_over; ++i) {
    const int result = nl_recvmsgs(socket_.get(), callbacks.get());
    if (result < 0 && !reading.is_over) {
      reading.answer.error = result == -NLE_AGAIN ? ETIMEDOUT : EIO;
      break;
    }
  }
  return reading.answer;
}

}  // namespace swarmtalk::nl80211
