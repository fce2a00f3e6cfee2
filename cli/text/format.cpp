#include "cli/text/format.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string_view>
#include <vector>

#include "cli/text/hex.hpp"
#include "text/plain.hpp"
#include "text/utf8.hpp"

namespace swarmtalk::cli {
namespace {

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

std::string counters(const std::vector<Counter>& list) {
  std::string text;
  for (const Counter& counter : list) {
    if (counter.value == 0) continue;
    text += "  " + counter.name + " " + std::to_string(counter.value) + "\n";
  }
  return text;
}

/// Of a table, the column with this heading.
void leave_out(std::string_view heading, std::vector<Row>& rows) {
  const auto place = std::find(rows[0].begin(), rows[0].end(), heading) - rows[0].begin();
  for (Row& row : rows) row.erase(row.begin() + place);
}

/// Of links and daemon, those that have counted something.
std::string all_counters(const DaemonStatus& status, const Look& look) {
  std::string text;
  for (const LinkStatus& link : status.links) {
    const std::string list = counters(link.counters);
    if (!list.empty()) text += "\nCounters of " + link.name + "\n" + list;
  }
  const std::string list = counters(status.counters);
  if (!list.empty()) text += "\nCounters of the daemon\n" + list;
  return folded(text, look);
}

Json counters_json(const std::vector<Counter>& list) {
  Json json = Json::object();
  for (const Counter& counter : list) json[counter.name] = counter.value;
  return json;
}

}  // namespace

namespace {

/// Wall clock, so that logs of several robots can be put side by side; microseconds.
Json unix_seconds(const std::optional<std::chrono::steady_clock::time_point>& received_at) {
  if (!received_at) return nullptr;
  using std::chrono::microseconds;
  const auto age = std::chrono::steady_clock::now() - *received_at;
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch() - age;
  const auto count = std::chrono::duration_cast<microseconds>(since_1970).count();
  return static_cast<double>(count) / 1e6;
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
  json["transmitter"] = message.transmitter;
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
  json["received_at_unix_s"] = unix_seconds(message.received_at);
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
  if (text::is_utf8(message.payload)) json["text"] = message.payload;
  json["hex"] = to_hex(message.payload);
  return json;
}

Json to_json(const DaemonStatus& status) {
  Json json;
  json["version"] = status.version;
  json["node_id"] = status.node_id;
  json["node_id_fixed"] = status.node_id_fixed;
  json["node_id_source"] = status.node_id_source;
  json["epoch"] = status.epoch;
  json["uptime_ms"] = status.uptime.count();
  json["clients"] = status.clients;
  json["config_file"] = status.config_file;
  json["pose"] = to_json(status.pose);
  json["pose_age_ms"] = nullptr;
  if (status.pose_age) json["pose_age_ms"] = status.pose_age->count();
  json["pose_told_by"] = status.pose_told_by;
  json["pose_max_age_ms"] = status.pose_max_age.count();
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
                                {"onlookers", channel.onlookers},
                                {"timestamped", channel.timestamped},
                                {"links", channel.links},
                                {"received", channel.received},
                                {"lost", to_json(channel.lost)},
                                {"refused", channel.refused}});
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
                                      {"messages_published", client.messages_published},
                                      {"refused", client.refused}});
  }
  json["users"] = Json::array();
  for (const UserStatus& user : status.users) {
    Json shares = Json::object();
    for (const ShareStatus& share : user.shares) {
      shares[share.name] = {{"used", share.used}, {"limit", share.limit}};
    }
    json["users"].push_back(
        {{"uid", user.uid}, {"operator", user.is_operator}, {"shares", shares}});
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
                    {"out_of_range", each.out_of_range},
                    {"ghost", each.is_ghost},
                    {"signal_dbm", nullptr}});
    if (each.signal_dbm) json.back()["signal_dbm"] = *each.signal_dbm;
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

namespace {

/// Whose distance and bearing follow, unless they are the sender's.
std::string via(const Message& message) {
  if (message.transmitter != 0 && message.transmitter != message.sender) {
    return "  via robot " + std::to_string(message.transmitter);
  }
  const bool is_relayed = message.hops > 0 && message.hops != Message::kHopsUnknown;
  return is_relayed ? "  via another robot" : "";
}

}  // namespace

std::string to_line(const std::string& channel, const Message& message, const Look& look) {
  std::string line =
      channel + ": robot " + std::to_string(message.sender) + "  " + payload_text(message.payload);
  if (message.local) {
    line += "  from this robot";
  } else {
    line += via(message) + "  distance " + metres(message.distance_m) + "  bearing " +
            degrees(message.bearing_rad) + "  hops " +
            (message.hops == Message::kHopsUnknown ? "unknown" : std::to_string(message.hops));
  }
  if (message.origin) {
    line += "  through a gateway";
    if (!message.origin->link.empty()) {
      line += " from robot " + std::to_string(message.origin->node) + " on link " +
              text::shown_name(message.origin->link);
    }
  }
  if (message.buffering_delay) {
    line += "  delay " + std::to_string(message.buffering_delay->count()) + " us";
  }
  if (message.lost_before) {
    line += "  " + look.warning("(lost before it: " + loss_text(message.lost_before) + ")");
  }
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

namespace {

std::string shares_table(const std::vector<UserStatus>& users, const Look& look) {
  std::vector<Row> rows{{"USER"}};
  for (const ShareStatus& share : users.front().shares) rows[0].push_back(share.name);
  for (const UserStatus& user : users) {
    Row row{"uid " + std::to_string(user.uid)};
    for (const ShareStatus& share : user.shares) {
      const std::string limit = share.limit == 0 ? "" : " of " + std::to_string(share.limit);
      row.push_back(std::to_string(share.used) + limit);
    }
    rows.push_back(row);
  }
  return table(rows, look);
}

}  // namespace

std::string to_stats(const DaemonStatus& status, const Look& look) {
  const auto text_of = [](std::uint64_t value) { return std::to_string(value); };
  std::string text;
  std::vector<Row> channels{{"CHANNEL", "RECEIVED", "LOST ON THE AIR", "IN THE KERNEL",
                             "FOR MEMORY", "CAME LATE", "REFUSED"}};
  for (const ChannelStatus& channel : status.channels) {
    const std::string name =
        channel.name.empty() ? text_of(channel.number) : text::shown_name(channel.name);
    channels.push_back({name, text_of(channel.received), text_of(channel.lost.air),
                        text_of(channel.lost.kernel), text_of(channel.lost.daemon),
                        text_of(channel.lost.late), text_of(channel.refused)});
  }
  text += table(channels, look);
  std::vector<Row> clients{{"PROGRAM", "PID", "PUBLISHED", "REFUSED", "DELIVERED", "WAITING",
                            "BYTES", "LOST IN THE DAEMON", "IN THE PROGRAM"}};
  for (const ClientStatus& client : status.clients_served) {
    clients.push_back(
        {text::shown_name(client.name), text_of(client.pid), text_of(client.messages_published),
         text_of(client.refused), text_of(client.deliveries_sent), text_of(client.queued_messages),
         text_of(client.queued_bytes), text_of(client.lost_daemon), text_of(client.lost_client)});
  }
  text += "\n" + table(clients, look);
  if (!status.users.empty()) text += "\n" + shares_table(status.users, look);
  return text + all_counters(status, look);
}

std::string to_line(const Pose& pose) {
  return "x " + format("%.3f m", static_cast<double>(pose.x_m)) + "  y " +
         format("%.3f m", static_cast<double>(pose.y_m)) + "  theta " + degrees(pose.theta_rad) +
         "  age " + std::to_string(pose.age.count()) + " ms";
}

std::string pose_text(const DaemonStatus& status) {
  if (status.pose) {
    return to_line(*status.pose) +
           (status.pose_told_by.empty() ? "" : ", told by " + status.pose_told_by);
  }
  if (!status.pose_age) return "unknown: nobody has told one";
  const auto seconds_of = [](std::chrono::milliseconds value) {
    return format("%.1f s", static_cast<double>(value.count()) / 1000);
  };
  return "too old: set by " + status.pose_told_by + " " + seconds_of(*status.pose_age) +
         " ago; poses expire after " + seconds_of(status.pose_max_age) +
         " (node.pose_max_age_ms of the configuration)";
}

std::string to_text(const std::vector<Neighbour>& neighbours, const Look& look, bool is_whole) {
  std::vector<Row> rows{{"ROBOT", "LINK", "DISTANCE", "BEARING", "HEARD AGO", "LOSS", "SIGNAL",
                         "ADDRESS", "POSE", ""}};
  for (const Neighbour& each : neighbours) {
    std::string remark = each.duplicate_id ? "TWO ROBOTS HAVE THIS ID" : "";
    if (each.out_of_range) remark += remark.empty() ? "out of range" : ", out of range";
    if (each.is_ghost) remark += remark.empty() ? "ghost" : ", ghost";
    rows.push_back({std::to_string(each.node_id), each.link, metres(each.distance_m),
                    degrees(each.bearing_rad), std::to_string(each.age.count()) + " ms",
                    format("%.0f %%", 100 * static_cast<double>(each.loss)),
                    each.signal_dbm ? std::to_string(*each.signal_dbm) + " dBm" : "-", each.address,
                    each.pose ? to_line(*each.pose) : "unknown", remark});
  }
  if (neighbours.empty()) {
    return folded(
        "nobody was heard within the last 10 s; a robot whose programs send nothing "
        "is heard only with beacon_ms in its configuration\n",
        look);
  }
  if (!is_whole) {
    leave_out("POSE", rows);
    leave_out("ADDRESS", rows);
    const auto has_signal = [](const Neighbour& each) { return each.signal_dbm.has_value(); };
    if (std::none_of(neighbours.begin(), neighbours.end(), has_signal)) leave_out("SIGNAL", rows);
    const auto is_on_first = [&](const Neighbour& each) {
      return each.link == neighbours.front().link;
    };
    if (std::all_of(neighbours.begin(), neighbours.end(), is_on_first)) leave_out("LINK", rows);
  }
  return table(rows, look);
}

std::string to_text(const DaemonStatus& status, const Look& look) {
  std::string text = "swarmtalkd " + status.version + ", robot " + std::to_string(status.node_id) +
                     (status.node_id_source.empty() ? "" : " (" + status.node_id_source + ")") +
                     ", up " + duration(status.uptime) + ", " + std::to_string(status.clients) +
                     (status.clients == 1 ? " client\n" : " clients\n");
  text += "pose    " + pose_text(status) + "\n";
  if (!status.config_file.empty()) text += "config  " + status.config_file + "\n";
  text = folded(text, look);
  std::vector<Row> links{{"LINK", "TYPE", "DEVICE", "PROFILE", "ROBOT", "PACKETS UP TO",
                          "MESSAGES UP TO", "MAX TTL", "STATE"}};
  for (const LinkStatus& link : status.links) {
    links.push_back({link.name, link.type, link.device, link.profile, std::to_string(link.node_id),
                     std::to_string(link.mtu_bytes) + " bytes",
                     std::to_string(link.max_message_bytes) + " bytes",
                     std::to_string(link.max_ttl), link.state});
  }
  text += "\n" + table(links, look);
  std::vector<Row> channels{{"CHANNEL", "NUMBER", "PUBLISHERS", "SUBSCRIBERS", ""}};
  for (const ChannelStatus& channel : status.channels) {
    channels.push_back({channel.name.empty() ? "-" : text::shown_name(channel.name),
                        std::to_string(channel.number), std::to_string(channel.publishers),
                        std::to_string(channel.subscribers),
                        channel.timestamped ? "timestamped" : ""});
  }
  if (channels.size() > 1) text += "\n" + table(channels, look);
  return text + folded("\nwhat was sent, heard and lost: swarmtalk-cli stats\n", look);
}

}  // namespace swarmtalk::cli
