#include "cli/look/top_view.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "cli/text/columns.hpp"
#include "cli/text/numbers.hpp"
#include "text/channel_name.hpp"

namespace swarmtalk::cli {
namespace {

using Rows = std::vector<std::vector<std::string>>;

double per_s(std::uint64_t before, std::uint64_t now, double seconds) {
  return now < before ? 0 : static_cast<double>(now - before) / seconds;  // less: a restart
}

Json losses_json(const Loss& before, const Loss& now, double seconds) {
  return {{"air", number_of(per_s(before.air, now.air, seconds))},
          {"kernel", number_of(per_s(before.kernel, now.kernel, seconds))},
          {"daemon", number_of(per_s(before.daemon, now.daemon, seconds))}};
}

/// Messages and bytes on the air, and robots that publish.
Json air_json(const AirChannel& before, const AirChannel& now, double seconds) {
  Json robots = Json::array();
  double messages = 0;
  double bytes = 0;
  for (const auto& [node, from] : now.publishers) {
    const auto old = before.publishers.find(node);
    const AirPublisher then = old == before.publishers.end() ? AirPublisher() : old->second;
    messages += per_s(then.messages, from.messages, seconds);
    bytes += per_s(then.bytes, from.bytes, seconds);
    robots.push_back(node);
  }
  return {{"robots", robots},
          {"messages_per_s", number_of(messages)},
          {"bytes_per_s", number_of(bytes)},
          {"forwarded_per_s", number_of(per_s(before.forwarded, now.forwarded, seconds))}};
}

Json channels_json(const TopState& before, const TopState& now, double seconds) {
  std::map<std::uint16_t, Json> all;
  const auto entry = [&all](std::uint16_t number) -> Json& {
    Json& json = all[number];
    if (json.is_null()) {
      json = {{"number", number},
              {"name", nullptr},
              {"publishers_here", 0},
              {"subscribers_here", 0},
              {"received_per_s", nullptr},
              {"lost_per_s", nullptr},
              {"on_air", air_json({}, {}, 1)}};
    }
    return json;
  };
  for (const ChannelStatus& channel : now.daemon.channels) {
    Json& json = entry(channel.number);
    if (!channel.name.empty()) json["name"] = channel.name;
    json["publishers_here"] = channel.publishers;
    json["subscribers_here"] = channel.subscribers;
    const auto old = std::find_if(before.daemon.channels.begin(), before.daemon.channels.end(),
                                  [&](const auto& each) { return each.number == channel.number; });
    if (old == before.daemon.channels.end() || channel.subscribers == 0) continue;
    json["received_per_s"] = number_of(per_s(old->received, channel.received, seconds));
    json["lost_per_s"] = losses_json(old->lost, channel.lost, seconds);
  }
  for (const auto& [number, channel] : now.air) {
    const auto old = before.air.find(number);
    entry(number)["on_air"] =
        air_json(old == before.air.end() ? AirChannel() : old->second, channel, seconds);
  }
  Json list = Json::array();
  for (auto& [number, json] : all) list.push_back(std::move(json));
  return list;
}

Json programs_json(const TopState& before, const TopState& now, double seconds) {
  Json list = Json::array();
  for (const ClientStatus& client : now.daemon.clients_served) {
    if (client.pid == now.own_pid) continue;
    const auto old = std::find_if(
        before.daemon.clients_served.begin(), before.daemon.clients_served.end(),
        [&](const auto& each) { return each.pid == client.pid && each.name == client.name; });
    const ClientStatus then = old == before.daemon.clients_served.end() ? client : *old;
    list.push_back(
        {{"name", client.name},
         {"pid", client.pid},
         {"published_per_s",
          number_of(per_s(then.messages_published, client.messages_published, seconds))},
         {"delivered_per_s",
          number_of(per_s(then.deliveries_sent, client.deliveries_sent, seconds))},
         {"waiting", client.queued_messages},
         {"lost_in_daemon_per_s", number_of(per_s(then.lost_daemon, client.lost_daemon, seconds))},
         {"lost_in_program_per_s",
          number_of(per_s(then.lost_client, client.lost_client, seconds))}});
  }
  return list;
}

std::string cell(const Json& value) {
  if (value.is_null()) return "-";
  if (!value.is_number()) return value.dump();
  const double number = value.get<double>();
  char text[32];
  std::snprintf(text, sizeof text, number > 0 && number < 10 ? "%.1f" : "%.0f", number);
  return text;
}

double lost_of(const Json& channel) {
  double sum = 0;
  for (const Json& each : channel["lost_per_s"]) sum += each.get<double>();
  return sum;
}

std::string name_of(const Json& channel) {
  return channel["name"].is_null() ? channel["number"].dump()
                                   : payload_name(channel["name"].get<std::string>());
}

bool has(const std::string& name, const std::string& filter) {
  return filter.empty() || name.find(filter) != std::string::npos;
}

/// Nobody here has told its name, and its number is the one that this name gives.
bool is_called(const Json& channel, const std::string& name) {
  return channel["name"].is_null() && name.find_first_not_of("0123456789") != std::string::npos &&
         channel["number"].get<std::uint32_t>() == text::hashed_channel(name);
}

/// By name; or the most first, and those of the same figure by name.
template <typename Figure, typename Name>
std::vector<Json> sorted(const Json& list, const TopLook& look, Name name, Figure figure) {
  std::vector<Json> all;
  for (const Json& each : list) {
    const bool is_wanted =
        has(name(each), look.filter) || (each.contains("number") && is_called(each, look.filter));
    if (is_wanted) all.push_back(each);
  }
  std::stable_sort(all.begin(), all.end(), [&](const Json& a, const Json& b) {
    const double first = figure(a);
    const double second = figure(b);
    return first != second ? first > second : name(a) < name(b);
  });
  return all;
}

Rows channel_rows(const Json& top, const TopLook& look) {
  Rows rows{
      {"CHANNEL", "MSG/S", "BYTES/S", "HEARD/S", "LOST AIR", "KERNEL", "DAEMON", "HERE", "ROBOTS"}};
  const auto figure = [&](const Json& each) {
    if (look.sort == "rate") return each["on_air"]["messages_per_s"].get<double>();
    return look.sort == "lost" ? lost_of(each) : 0.0;
  };
  for (const Json& each : sorted(top["channels"], look, name_of, figure)) {
    const Json& air = each["on_air"];
    const Json& lost = each["lost_per_s"];
    const auto lost_cell = [&](const char* key) { return lost.is_null() ? "-" : cell(lost[key]); };
    std::string robots;
    for (const Json& node : air["robots"]) robots += (robots.empty() ? "" : " ") + node.dump();
    rows.push_back({name_of(each), cell(air["messages_per_s"]), cell(air["bytes_per_s"]),
                    cell(each["received_per_s"]), lost_cell("air"), lost_cell("kernel"),
                    lost_cell("daemon"),
                    each["publishers_here"].dump() + "p " + each["subscribers_here"].dump() + "s",
                    robots.empty() ? "-" : clip(robots, 20)});
  }
  return rows;
}

Rows program_rows(const Json& top, const TopLook& look) {
  Rows rows{{"PROGRAM", "SENT/S", "HEARD/S", "LOST DAEMON", "ITSELF", "WAITING", "PID"}};
  const auto name = [](const Json& each) { return payload_name(each["name"].get<std::string>()); };
  const auto figure = [&](const Json& each) {
    if (look.sort == "rate") {
      return each["published_per_s"].get<double>() + each["delivered_per_s"].get<double>();
    }
    return look.sort == "lost" ? each["lost_in_daemon_per_s"].get<double>() +
                                     each["lost_in_program_per_s"].get<double>()
                               : 0.0;
  };
  for (const Json& each : sorted(top["programs"], look, name, figure)) {
    rows.push_back({name(each), cell(each["published_per_s"]), cell(each["delivered_per_s"]),
                    cell(each["lost_in_daemon_per_s"]), cell(each["lost_in_program_per_s"]),
                    each["waiting"].dump(), each["pid"].dump()});
  }
  return rows;
}

Rows neighbour_rows(const Json& top, const TopLook& look) {
  Rows rows{{"NEIGHBOUR", "LOST %", "DISTANCE", "BEARING", "HEARD", "LINK", "REMARK"}};
  const auto name = [](const Json& each) { return each["node_id"].dump(); };
  const auto figure = [&](const Json& each) {
    return look.sort == "lost" ? each["loss"].get<double>() : 0.0;
  };
  const auto unknown_or = [](const Json& value) {
    return value.is_null() ? Message::kUnknown : value.get<float>();
  };
  std::vector<Json> all = sorted(top["neighbours"], look, name, figure);
  if (look.sort != "lost") {
    std::stable_sort(all.begin(), all.end(), [](const Json& a, const Json& b) {
      return a["node_id"].get<std::uint32_t>() < b["node_id"].get<std::uint32_t>();
    });
  }
  for (const Json& each : all) {
    rows.push_back({name(each), cell(100 * each["loss"].get<double>()),
                    metres(unknown_or(each["distance_m"])),
                    degrees(unknown_or(each["bearing_rad"])), each["age_ms"].dump() + " ms ago",
                    payload_name(each["link"].get<std::string>()),
                    each["duplicate_id"].get<bool>()   ? "TWO ROBOTS HAVE THIS ID"
                    : each["out_of_range"].get<bool>() ? "out of range"
                    : each["ghost"].get<bool>()        ? "ghost"
                                                       : ""});
  }
  return rows;
}

struct Table {
  Rows rows;  // the first is the head
  std::string_view alignment;
  std::size_t room = 2;  // lines, with the head

  /// Rows that are seen where not all are: the head and a line about the others need room too.
  std::size_t seen() const { return rows.size() <= room ? rows.size() - 1 : room - 2; }
  std::size_t unseen() const { return rows.size() - 1 - seen(); }
  std::size_t most_down() const { return seen() == 0 ? 0 : unseen(); }
};

/// What one needs less, the others have more; each has its head and a line.
std::array<Table, 3> tables_of(const Json& top, const TopLook& look) {
  std::array<Table, 3> tables{{{channel_rows(top, look), "lrrrrrrll"},
                               {program_rows(top, look), "lrrrrrr"},
                               {neighbour_rows(top, look), "lrrrrll"}}};
  const std::size_t around = 1 + 3 + (look.foot.empty() ? 0 : 1);
  std::size_t room = look.height > around ? look.height - around : 0;
  std::array<Table*, 3> shortest{&tables[0], &tables[1], &tables[2]};
  std::stable_sort(shortest.begin(), shortest.end(),
                   [](const Table* a, const Table* b) { return a->rows.size() < b->rows.size(); });
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t share = std::max<std::size_t>(2, room / (3 - i));
    Table& table = *shortest[i];
    table.room = std::min(share, std::max<std::size_t>(2, table.rows.size()));
    room -= std::min(room, table.room);
  }
  return tables;
}

/// The head and as many lines as fit; of what is left out the number.
/// @param none  what stands there when there is nothing
void add(const Table& table, const TopLook& look, const char* none,
         std::vector<std::string>& lines) {
  const std::vector<std::string> all = columns(table.rows, table.alignment, look.width);
  const std::size_t above = std::min(look.down, table.most_down());
  const std::size_t below = table.unseen() - above;
  lines.push_back(all[0]);
  const auto first = all.begin() + 1 + static_cast<std::ptrdiff_t>(above);
  lines.insert(lines.end(), first, first + static_cast<std::ptrdiff_t>(table.seen()));
  std::string rest;
  if (below > 0) rest = "and " + std::to_string(below) + " more";
  if (above > 0) rest += (rest.empty() ? "" : ", ") + std::to_string(above) + " above";
  if (above == 0 && table.most_down() > 0 && !look.foot.empty()) rest += ": arrow down";
  if (!rest.empty()) lines.push_back(clip("  " + rest, look.width));
  if (table.rows.size() == 1) lines.emplace_back(none);
}

}  // namespace

Json top_json(const TopState& before, const TopState& now, double seconds) {
  Json links = Json::array();
  for (const LinkStatus& link : now.daemon.links) {
    links.push_back({{"name", link.name}, {"up", link.up}, {"state", link.state}});
  }
  Json neighbours = to_json(now.neighbours);
  return {{"node_id", now.daemon.node_id},
          {"uptime_ms", now.daemon.uptime.count()},
          {"seconds", number_of(seconds)},
          {"sealed_frames", now.sealed_frames},
          {"pose", to_json(now.daemon.pose)},
          {"links", links},
          {"channels", channels_json(before, now, seconds)},
          {"programs", programs_json(before, now, seconds)},
          {"neighbours", neighbours["neighbours"]}};
}

std::vector<std::string> top_lines(const Json& top, const TopLook& look) {
  std::vector<std::string> lines;
  std::string head = "robot " + top["node_id"].dump();
  for (const Json& link : top["links"]) {
    head += "  " + payload_name(link["name"].get<std::string>()) +
            (link["up"].get<bool>() ? " up" : " DOWN");
  }
  if (top["sealed_frames"].get<std::uint64_t>() > 0) {
    head += "  sealed frames: channels of others are not seen";
  }
  lines.push_back(clip(head, look.width));
  for (const Table& table : tables_of(top, look)) {
    lines.emplace_back();
    add(table, look, look.filter.empty() ? "  none" : "  none of that name", lines);
  }
  if (!look.foot.empty()) {  // the keys are seen however low the terminal is
    lines.resize(std::min(lines.size(), std::max<std::size_t>(look.height, 2) - 1));
    lines.push_back(clip(look.foot, look.width));
  }
  return lines;
}

std::size_t top_most_down(const Json& top, const TopLook& look) {
  std::size_t most = 0;
  for (const Table& table : tables_of(top, look)) most = std::max(most, table.most_down());
  return most;
}

std::size_t top_page(const Json& top, const TopLook& look) {
  std::size_t page = 0;
  for (const Table& table : tables_of(top, look)) {
    if (table.most_down() > 0) page = page == 0 ? table.seen() : std::min(page, table.seen());
  }
  return std::max<std::size_t>(page, 1);
}

}  // namespace swarmtalk::cli
