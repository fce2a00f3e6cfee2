// The part of the C interface that tells of poses, of other robots and of their values.
#include <cmath>
#include <optional>
#include <string>
#include <swarmtalk/client/harvest.hpp>
#include <vector>

#include "client_lib/c_api.hpp"

using swarmtalk::Client;
using swarmtalk::Harvest;
using swarmtalk::HarvestedValue;
using swarmtalk::Neighbour;
using swarmtalk::Pose;
using swarmtalk::Status;
using swarmtalk::StatusCode;
using swarmtalk::c_api::code_of;
using swarmtalk::c_api::guarded;

struct swarmtalk_harvest {
  swarmtalk_client* client;
  Harvest harvest;
};

namespace {

swarmtalk_pose c_pose(const std::optional<Pose>& pose) {
  if (!pose) return {NAN, NAN, NAN, 0};
  return {pose->x_m, pose->y_m, pose->theta_rad, static_cast<std::uint32_t>(pose->age.count())};
}

swarmtalk_neighbour c_neighbour(const Neighbour& from) {
  swarmtalk_neighbour to{};
  to.link = from.link.c_str();
  to.node_id = from.node_id;
  to.epoch = from.epoch;
  to.address = from.address.c_str();
  to.age_ms = static_cast<std::uint32_t>(from.age.count());
  to.distance_m = from.distance_m;
  to.bearing_rad = from.bearing_rad;
  to.pose = c_pose(from.pose);
  to.frames = from.frames;
  to.frames_lost = from.frames_lost;
  to.loss = from.loss;
  to.duplicate_id = from.duplicate_id ? 1 : 0;
  to.out_of_range = from.out_of_range ? 1 : 0;
  return to;
}

swarmtalk_value c_value(const HarvestedValue& from) {
  swarmtalk_value to{};
  to.node_id = from.node_id;
  to.epoch = from.epoch;
  to.hops = from.hops;
  to.local = from.local ? 1 : 0;
  to.key = from.key.c_str();
  to.value = from.value.c_str();
  to.value_bytes = from.value.size();
  return to;
}

Status is_null(const char* what) {
  return Status(StatusCode::kBadArgument, std::string(what) + " is NULL");
}

}  // namespace

extern "C" {

swarmtalk_status swarmtalk_set_fixed_pose(swarmtalk_client* client, float x_m, float y_m,
                                          float theta_rad) {
  return guarded(client, [&](Client& robot) { return robot.set_fixed_pose(x_m, y_m, theta_rad); });
}

swarmtalk_status swarmtalk_get_pose(swarmtalk_client* client, swarmtalk_pose* pose) {
  return guarded(client, [&](Client& robot) {
    if (pose == nullptr) return is_null("the pose");
    std::optional<Pose> present;
    Status status = robot.get_pose(present);
    *pose = c_pose(present);
    return status;
  });
}

swarmtalk_status swarmtalk_neighbours(swarmtalk_client* client, swarmtalk_neighbour_fn each,
                                      void* context) {
  return guarded(client, [&](Client& robot) {
    if (each == nullptr) return is_null("the callback");
    std::vector<Neighbour> neighbours;
    Status status = robot.get_neighbours(neighbours);
    if (!status) return status;
    for (const Neighbour& neighbour : neighbours) {
      const swarmtalk_neighbour to = c_neighbour(neighbour);
      each(&to, context);
    }
    return status;
  });
}

swarmtalk_status swarmtalk_sync(swarmtalk_client* client) {
  return guarded(client, [](Client& robot) { return robot.sync(); });
}

swarmtalk_harvest* swarmtalk_harvest_open(swarmtalk_client* client) {
  try {
    return new swarmtalk_harvest{client, Harvest(client->client)};
  } catch (const std::exception& error) {
    client->error->keep(error.what());
    return nullptr;
  }
}

swarmtalk_status swarmtalk_harvest_status(const swarmtalk_harvest* harvest) {
  return guarded(harvest->client, [&](Client&) { return harvest->harvest.status(); });
}

swarmtalk_status swarmtalk_harvest_set(swarmtalk_harvest* harvest, const char* key,
                                       const char* value) {
  return guarded(harvest->client, [&](Client&) {
    if (key == nullptr) return is_null("the key");
    if (value != nullptr) return harvest->harvest.set(key, value);
    harvest->harvest.remove(key);
    return Status();
  });
}

swarmtalk_status swarmtalk_harvest_ask(swarmtalk_harvest* harvest, const char* prefix, uint32_t ttl,
                                       swarmtalk_value_fn found, void* context) {
  return guarded(harvest->client, [&](Client&) {
    if (found == nullptr) return is_null("the callback");
    const auto tell = [found, context](const HarvestedValue& value) {
      const swarmtalk_value to = c_value(value);
      found(&to, context);
    };
    return harvest->harvest.ask(prefix == nullptr ? "" : prefix, tell, ttl);
  });
}

void swarmtalk_harvest_close(swarmtalk_harvest* harvest) {
  delete harvest;
}

}  // extern "C"
