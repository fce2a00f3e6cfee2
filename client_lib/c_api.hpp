// What the files of the C interface share.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <string>
#include <swarmtalk/client.hpp>

#include "swarmtalk/swarmtalk.h"

struct swarmtalk_client {
  swarmtalk::Client client;
  std::string error;  // of the last call that failed
};

namespace swarmtalk::c_api {

inline swarmtalk_status code_of(const Status& status) {
  return static_cast<swarmtalk_status>(status.code());
}

/// A struct that the caller filled, as this library has it: what the caller's lacks is 0.
/// @param given        null: all 0
/// @param first_bytes  of the first release, which struct_bytes 0 stands for
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
  try {
    const Status status = call(client->client);
    if (!status) client->error = status.text();
    return code_of(status);
  } catch (const std::exception& error) {
    client->error = error.what();
    return SWARMTALK_SYSTEM;
  }
}

}  // namespace swarmtalk::c_api
