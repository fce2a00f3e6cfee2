// What the files of the C interface share.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <swarmtalk/client.hpp>
#include <thread>

#include "swarmtalk/swarmtalk.h"

namespace swarmtalk::c_api {

/// The sentence of the last call that failed on the thread that the client belongs to. Publishers,
/// which any thread may call, share it, and may outlive their client.
class LastError {
 public:
  /// For a call that only the client's own thread may make.
  void belong_here() { owner_.store(std::this_thread::get_id()); }
  bool belongs_here() const { return owner_.load() == std::this_thread::get_id(); }
  /// @pre belongs_here()
  void keep(std::string_view text) noexcept {
    try {
      text_ = text;
    } catch (const std::exception&) {
      text_.clear();  // no memory: better than the sentence of another call
    }
  }
  const char* text() const { return text_.c_str(); }

 private:
  std::atomic<std::thread::id> owner_{std::this_thread::get_id()};
  std::string text_;
};

}  // namespace swarmtalk::c_api

struct swarmtalk_client {
  swarmtalk::Client client;
  std::shared_ptr<swarmtalk::c_api::LastError> error =
      std::make_shared<swarmtalk::c_api::LastError>();
};

namespace swarmtalk::c_api {

inline swarmtalk_status code_of(const Status& status) {
  return static_cast<swarmtalk_status>(status.code());
}

/// A struct that the caller filled, as this library has it: what the caller's lacks is 0.
/// @param given        null: all 0
/// @param first_bytes  of release 0.1, which struct_bytes 0 stands for
/// @throws std::invalid_argument  it says something in members that this library does not have
template <typename Struct>
Struct as_ours(const Struct* given, std::size_t first_bytes, const std::string& name) {
  Struct ours{};
  if (given == nullptr) return ours;
  const std::size_t bytes = given->struct_bytes == 0 ? first_bytes : given->struct_bytes;
  if (bytes < first_bytes) {
    throw std::invalid_argument("struct_bytes of " + name + " is " + std::to_string(bytes) +
                                "; set it to sizeof(" + name + ")");
  }
  std::memcpy(&ours, given, std::min(bytes, sizeof ours));
  const char* const begin = reinterpret_cast<const char*>(given);
  if (std::any_of(begin + std::min(bytes, sizeof ours), begin + bytes,
                  [](char byte) { return byte != 0; })) {
    throw std::invalid_argument(name + " is of a newer release than this library, which has " +
                                std::to_string(sizeof ours) + " of its " + std::to_string(bytes) +
                                " bytes; install the newer libswarmtalk-c");
  }
  return ours;
}

/// Runs a call of a client; keeps why it failed.
template <typename Call>
swarmtalk_status guarded(swarmtalk_client* client, Call call) {
  client->error->belong_here();
  try {
    const Status status = call(client->client);
    if (!status) client->error->keep(status.text());
    return code_of(status);
  } catch (const std::exception& error) {
    client->error->keep(error.what());
    return SWARMTALK_SYSTEM;
  }
}

}  // namespace swarmtalk::c_api
