// What the files of the C interface share.
#pragma once

#include <exception>
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
