#include "cli/format.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "cli/hex.hpp"
#include "client_lib/utf8.hpp"

namespace swarmtalk::cli {
namespace {

using Row = std::vector<std::string>;

/// Columns as wide as their widest cell, two spaces apart.
std::string table(const std::vector<Row>& rows) {
  std::vector<std::size_t> widths(rows.front().size());
  for (const Row& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string text;
  for (const Row& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      line += row[i] + std::string(widths[i] - row[i].size() + 2, ' ');
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

std::string format(const char* pattern, double value) {
  char text[64];
  std::snprintf(text, sizeof(text), pattern, value);
  return text;
}

/// 1 d 02:03:04
std::string duration(std::chrono::milliseconds value) {
  const auto seconds = static_cast<unsigned long long>(value.count() / 1000);
  char text[64];
  std::snprintf(text, sizeof(text), "%llu d %02llu:%02llu:%02llu", seconds / 86400,
                seconds / 3600 % 24, seconds / 60 % 60, seconds % 60);
  return seconds < 86400 ? text + 4 : text;
}

std::string counters(const std::vector<Counter>& list, const std::string& indent) {
  std::string text;
  for (const Counter& counter : list) {
    if (counter.value == 0) continue;
    text += indent + counter.name + " " + std::to_string(counter.value) + "\n";
  }
  return text;
}

Json counters_json(const std::vector<Counter>& list) {
  Json json = Json::object();
  for (const Counter& counter : list) json[counter.name] = counter.value;
  return json;
}

}  // namespace

Json number(float value) {
  if (!std::isfinite(value)) return nullptr;
  return std::round(static_cast<double>(value) * 1e6) / 1e6;
}

Json to_json(const std::optional<Pose>& pose) {
  if (!pose) return nullptr;
  return {{"x_m", number(pose->x_m)},
          {"y_m", number(pose->y_m)},
          {"theta_rad", number(pose->theta_rad)},
          {"age_ms", pose->age.count()}};
}

Json to_json(const Loss& loss) {
  return {{"air", loss.air},
          {"kernel", loss.kernel},
          {"daemon", loss.daemon},
          {"client", loss.client},
          {"late", loss.late}};
}

Json to_json(const std::string& channel, const Message& message) {
  Json json;
  json["channel"] = channel;
  json["channel_number"] = message.channel;
  json["sender"] = message.sender;
  json["epoch"] = message.epoch;
  json["message_number"] = message.message_number;
  json["distance_m"] = number(message.distance_m);
  json["bearing_rad"] = number(message.bearing_rad);
  json["sender_pose"] = to_json(message.sender_pose);
  json["hops"] = message.hops;
  json["ttl"] = message.ttl;
  json["buffering_delay_us"] = nullptr;
  if (message.buffering_delay) json["buffering_delay_us"] = message.buffering_delay->count();
  json["received_at_ns"] = nullptr;
  if (message.received_at) {
    const auto at = message.received_at->time_since_epoch();
    json["received_at_ns"] = std::chrono::duration_cast<std::chrono::nanoseconds>(at).count();
  }
  json["local"] = message.local;
  json["lost_before"] = to_json(message.lost_before);
  json["origin"] = nullptr;
  if (message.origin) {
    json["origin"] = {{"link", nullptr}, {"node", nullptr}, {"message_number", nullptr}};
    if (!message.origin->link.empty()) {
      json["origin"] = {{"link", message.origin->link},
                        {"node", message.origin->node},
                        {"message_number", message.origin->message_number}};
    }
  }
  json["size_bytes"] = message.payload.size();
  json["text"] = nullptr;
  if (client::is_utf8(message.payload)) json["text"] = message.payload;
  json["hex"] = to_hex(message.payload);
  return json;
}

Json to_json(const DaemonStatus& status) {
  Json json;
  json["version"] = status.version;
  json["node_id"] = status.node_id;
  json["node_id_fixed"] = status.node_id_fixed;
  json["epoch"] = status.epoch;
  json["uptime_ms"] = status.uptime.count();
  json["clients"] = status.clients;
  json["config_file"] = status.config_file;
  json["pose"] = to_json(status.pose);
  json["links"] = Json::array();
  for (const LinkStatus& link : status.links) {
    json["links"].push_back({{"name", link.name},
                             {"type", link.type},
                             {"device", link.device},
                             {"profile", link.profile},
                             {"up", link.up},
                             {"state", link.state},
                             {"mtu_bytes", link.mtu_bytes},
                             {"max_message_bytes", link.max_message_bytes},
                             {"max_ttl", link.max_ttl},
                             {"node_id", link.node_id},
                             {"max_channel", link.max_channel},
                             {"counters", counters_json(link.counters)}});
  }
  json["channels"] = Json::array();
  for (const ChannelStatus& channel : status.channels) {
    json["channels"].push_back({{"number", channel.number},
                                {"name", channel.name},
                                {"publishers", channel.publishers},
                                {"subscribers", channel.subscribers},
                                {"timestamped", channel.timestamped},
                                {"links", channel.links},
                                {"received", channel.received},
                                {"lost", to_json(channel.lost)}});
  }
  json["clients_served"] = Json::array();
  for (const ClientStatus& client : status.clients_served) {
    json["clients_served"].push_back({{"name", client.name},
                                      {"pid", client.pid},
                                      {"uid", client.uid},
                                      {"subscriptions", client.subscriptions},
                                      {"publishers", client.publishers},
                                      {"queued_messages", client.queued_messages},
                                      {"queued_bytes", client.queued_bytes},
                                      {"deliveries_sent", client.deliveries_sent},
                                      {"lost_daemon", client.lost_daemon},
                                      {"lost_client", client.lost_client},
                                      {"messages_published", client.messages_published}});
  }
  json["counters"] = counters_json(status.counters);
  return json;
}

Json to_json(const std::vector<Neighbour>& neighbours) {
  Json json = Json::array();
  for (const Neighbour& each : neighbours) {
    json.push_back({{"link", each.link},
                    {"node_id", each.node_id},
                    {"epoch", each.epoch},
                    {"address", each.address},
                    {"age_ms", each.age.count()},
                    {"distance_m", number(each.distance_m)},
                    {"bearing_rad", number(each.bearing_rad)},
                    {"pose", to_json(each.pose)},
                    {"frames", each.frames},
                    {"frames_lost", each.frames_lost},
                    {"loss", number(each.loss)},
                    {"duplicate_id", each.duplicate_id},
                    {"out_of_range", each.out_of_range}});
  }
  return {{"neighbours", json}};
}

std::string metres(float value) {
  return std::isfinite(value) ? format("%.2f m", static_cast<double>(value)) : "unknown";
}

std::string degrees(float value_rad) {
  if (!std::isfinite(value_rad)) return "unknown";
  const double value = std::round(static_cast<double>(value_rad) * 180 / std::numbers::pi);
  return format("%.0f deg", value == 0 ? 0.0 : value);  // no "-0"
}

std::string payload_text(std::string_view payload) {
  if (payload.empty()) return "(empty)";
  const auto text = escaped(payload);
  return text ? "\"" + *text + "\"" : "hex " + to_hex(payload);
}

std::string to_line(const std::string& channel, const Message& message) {
  std::string line =
      channel + ": robot " + std::to_string(message.sender) + "  " + payload_text(message.payload);
  if (message.local) {
    line += "  from this robot";
  } else {
    line += "  distance " + metres(message.distance_m) + "  bearing " +
            degrees(message.bearing_rad) + "  hops " +
            (message.hops == Message::kHopsUnknown ? "unknown" : std::to_string(message.hops));
  }
  if (message.origin) {
    line += "  through a gateway";
    if (!message.origin->link.empty()) {
      line += " from robot " + std::to_string(message.origin->node) + " on link " +
              message.origin->link;
    }
  }
  if (message.buffering_delay) {
    line += "  delay " + std::to_string(message.buffering_delay->count()) + " us";
  }
  if (message.lost_before) line += "  (lost before it: " + loss_text(message.lost_before) + ")";
  return line;
}

std::string loss_text(const Loss& loss) {
  std::string places;
  const auto add = [&places](std::uint64_t count, const char* place) {
    if (count == 0) return;
    places += (places.empty() ? "" : ", ") + std::to_string(count) + " " + place;
  };
  add(loss.air, "on the air");
  add(loss.kernel, "in the kernel");
  add(loss.daemon, "in the daemon");
  add(loss.client, "in this program");
  if (loss.late > 0) {
    places += (places.empty() ? "none; " : "; ") + std::to_string(loss.late) +
              " of those before came after all";
  }
  return places;
}

std::string to_stats(const DaemonStatus& status) {
  const auto text_of = [](std::uint64_t value) { return std::to_string(value); };
  std::string text;
  std::vector<Row> channels{
      {"CHANNEL", "RECEIVED", "LOST ON THE AIR", "IN THE KERNEL", "FOR MEMORY", "CAME LATE"}};
  for (const ChannelStatus& channel : status.channels) {
    const std::string name = channel.name.empty() ? text_of(channel.number) : channel.name;
    channels.push_back({name, text_of(channel.received), text_of(channel.lost.air),
                        text_of(channel.lost.kernel), text_of(channel.lost.daemon),
                        text_of(channel.lost.late)});
  }
  text += table(channels);
  std::vector<Row> clients{{"PROGRAM", "PID", "PUBLISHED", "DELIVERED", "WAITING", "BYTES",
                            "LOST IN THE DAEMON", "IN THE PROGRAM"}};
  for (const ClientStatus& client : status.clients_served) {
    clients.push_back({client.name, text_of(client.pid), text_of(client.messages_published),
                       text_of(client.deliveries_sent), text_of(client.queued_messages),
                       text_of(client.queued_bytes), text_of(client.lost_daemon),
                       text_of(client.lost_client)});
  }
  text += "\n" + table(clients);
  for (const LinkStatus& link : status.links) {
    const std::string list = counters(link.counters, "  ");
    if (!list.empty()) text += "\nCounters of " + link.name + "\n" + list;
  }
  const std::string list = counters(status.counters, "  ");
  if (!list.empty()) text += "\nCounters of the daemon\n" + list;
  return text;
}

std::string to_line(const Pose& pose) {
  return "x " + format("%.3f m", static_cast<double>(pose.x_m)) + "  y " +
         format("%.3f m", static_cast<double>(pose.y_m)) + "  theta " + degrees(pose.theta_rad) +
         "  age " + std::to_string(pose.age.count()) + " ms";
}

std::string to_text(const std::vector<Neighbour>& neighbours) {
  std::vector<Row> rows{
      {"LINK", "ROBOT", "DISTANCE", "BEARING", "HEARD", "LOSS", "ADDRESS", "POSE", ""}};
  for (const Neighbour& each : neighbours) {
    std::string remark = each.duplicate_id ? "TWO ROBOTS HAVE THIS ID" : "";
    if (each.out_of_range) remark += remark.empty() ? "out of range" : ", out of range";
    rows.push_back({each.link, std::to_string(each.node_id), metres(each.distance_m),
                    degrees(each.bearing_rad), std::to_string(each.age.count()) + " ms ago",
                    format("%.0f %%", 100 * static_cast<double>(each.loss)), each.address,
                    each.pose ? to_line(*each.pose) : "unknown", remark});
  }
  return table(rows);
}

std::string to_text(const DaemonStatus& status) {
  std::string text = "swarmtalkd " + status.version + ", robot " + std::to_string(status.node_id) +
                     (status.node_id_fixed ? "" : " (automatic)") + ", up " +
                     duration(status.uptime) + ", " + std::to_string(status.clients) +
                     (status.clients == 1 ? " client\n" : " clients\n");
  text += "pose    " + (status.pose ? to_line(*status.pose) : "unknown") + "\n";
  if (!status.config_file.empty()) text += "config  " + status.config_file + "\n";
  std::vector<Row> links{{"LINK", "TYPE", "DEVICE", "PROFILE", "ROBOT", "PACKETS UP TO",
                          "MESSAGES UP TO", "MAX TTL", "STATE"}};
  for (const LinkStatus& link : status.links) {
    links.push_back({link.name, link.type, link.device, link.profile, std::to_string(link.node_id),
                     std::to_string(link.mtu_bytes) + " bytes",
                     std::to_string(link.max_message_bytes) + " bytes",
                     std::to_string(link.max_ttl), link.state});
  }
  text += "\n" + table(links);
  std::vector<Row> channels{{"CHANNEL", "NUMBER", "PUBLISHERS", "SUBSCRIBERS", ""}};
  for (const ChannelStatus& channel : status.channels) {
    channels.push_back({channel.name.empty() ? "-" : channel.name, std::to_string(channel.number),
                        std::to_string(channel.publishers), std::to_string(channel.subscribers),
                        channel.timestamped ? "timestamped" : ""});
  }
  if (channels.size() > 1) text += "\n" + table(channels);
  for (const LinkStatus& link : status.links) {
    const std::string list = counters(link.counters, "  ");
    if (!list.empty()) text += "\nCounters of " + link.name + "\n" + list;
  }
  const std::string list = counters(status.counters, "  ");
  if (!list.empty()) text += "\nCounters of the daemon\n" + list;
  return text;
}

}  // namespace swarmtalk::cli
