// Reads scenarios from TOML files. Every key is known here; one that is not is an error, because a
// misspelt key would silently run another experiment.
#include <filesystem>
#include <set>
#include <stdexcept>

#include "emulation/kilobot/scenario.hpp"
#include "text/toml_text.hpp"

namespace swarmtalk::emulator {
namespace {

/// One table of the file; remembers which keys were asked for, to name those that nobody knows.
class Section {
 public:
  Section(const std::string& file, const toml::table& table) : file_(file), table_(table) {}

  template <class T>
  void take(const char* key, T& value) {
    known_.insert(key);
    const toml::node* node = table_.get(key);
    if (node == nullptr) return;
    if constexpr (std::is_floating_point_v<T>) {
      const auto number = node->value<double>();
      if (!number) fail(*node, key, "a number");
      value = *number;
    } else if constexpr (std::is_same_v<T, bool>) {
      const auto flag = node->value_exact<bool>();
      if (!flag) fail(*node, key, "true or false");
      value = *flag;
    } else if constexpr (std::is_integral_v<T>) {
      const auto number = node->value_exact<std::int64_t>();
      if (!number || *number < 0 || !std::in_range<T>(*number))
        fail(*node, key, "a whole number in range");
      value = static_cast<T>(*number);
    } else {
      const auto text = node->value_exact<std::string>();
      if (!text) fail(*node, key, "a text");
      value = *text;
    }
  }

  template <class T>
  void take(const char* key, std::optional<T>& value) {
    known_.insert(key);
    if (!table_.contains(key)) return;
    T taken{};
    take(key, taken);
    value = taken;
  }

  void take(const char* key, Pin& pin) {
    std::string text;
    take(key, text);
    if (!text.empty()) pin = parse_pin(text);
  }

  /// A path, relative to the scenario's own folder.
  void take_path(const char* key, std::string& value) {
    std::string text;
    take(key, text);
    if (!text.empty()) value = (std::filesystem::path(file_).parent_path() / text).string();
  }

  std::vector<std::string> texts(const char* key) {
    known_.insert(key);
    std::vector<std::string> result;
    const toml::node* node = table_.get(key);
    if (node == nullptr) return result;
    if (!node->is_array()) fail(*node, key, "a list of texts");
    for (const toml::node& item : *node->as_array()) {
      const auto text = item.value_exact<std::string>();
      if (!text) fail(item, key, "a list of texts");
      result.push_back(*text);
    }
    return result;
  }

  /// Calls `use` with each table of a list, or with the one table.
  template <class Use>
  void each(const char* key, Use use) {
    known_.insert(key);
    const toml::node* node = table_.get(key);
    if (node == nullptr) return;
    if (const toml::table* one = node->as_table()) {
      use(Section(file_, *one));
    } else if (const toml::array* list = node->as_array()) {
      for (const toml::node& item : *list) {
        if (!item.is_table()) fail(item, key, "a table");
        use(Section(file_, *item.as_table()));
      }
    } else {
      fail(*node, key, "a table");
    }
  }

  void refuse_unknown() const {
    for (const auto& [key, node] : table_)
      if (!known_.contains(key.str()))
        throw std::runtime_error(where(node) + "unknown key \"" + std::string(key.str()) + "\"");
  }

 private:
  std::string where(const toml::node& node) const {
    return file_ + ":" + std::to_string(node.source().begin.line) + ": ";
  }

  [[noreturn]] void fail(const toml::node& node, const char* key, const char* expected) const {
    throw std::runtime_error(where(node) + key + " must be " + expected);
  }

  const std::string& file_;
  const toml::table& table_;
  std::set<std::string, std::less<>> known_;
};

void take_node(Section& section, NodeSpec& node) {
  section.take("name", node.name);
  section.take_path("image", node.image);
  section.take_path("bootloader", node.bootloader);
  section.take_path("eeprom", node.eeprom);
  section.take_path("save_eeprom", node.save_eeprom);
  section.take("uid", node.uid);
  section.take("power_on_ms", node.power_on_ms);
  section.take("drift_ppm", node.drift_ppm);
  section.take("infrared_pin", node.infrared_led);
  section.take("clock_hz", node.clock_hz);
  section.take("resets_to_bootloader", node.resets_to_bootloader);
  section.take("x_mm", node.x_mm);
  section.take("y_mm", node.y_mm);
  section.take("theta_rad", node.theta_rad);
  section.take("pty", node.serial_pty);
  node.has_pty = !node.serial_pty.empty();
}

void take_robots(Section robot, Scenario& scenario) {
  NodeSpec each;
  take_node(robot, each);
  std::string grid;
  double spacing_mm = 50;
  robot.take("grid", grid);
  robot.take("spacing_mm", spacing_mm);
  robot.refuse_unknown();
  if (grid.empty())
    scenario.robots.push_back(each);
  else
    add_grid(scenario, grid, spacing_mm, each);
}

void take_ohc(Section section, Scenario& scenario) {
  OhcSpec ohc;
  ohc.infrared_led = {'D', 3};
  take_node(section, ohc);
  section.take("reach_mm", ohc.reach_mm);
  section.take("status_pin", ohc.status_led);
  for (const std::string& text : section.texts("send"))
    scenario.ohc_serial.push_back(parse_serial(text));
  section.refuse_unknown();
  scenario.ohc = ohc;
}

void take_medium(Section section, MediumSettings& medium) {
  section.take("range_mm", medium.range_mm);
  section.take("loss", medium.loss);
  section.take("pulse_loss", medium.pulse_loss);
  section.take("stray_pulses_per_s", medium.stray_pulses_per_s);
  section.take("hears_itself", medium.hears_itself);
  section.take("delay_ns", medium.delay_ns);
  section.refuse_unknown();
}

}  // namespace

Scenario load_scenario(const std::string& path) {
  const toml::table table = text::parse_toml_file(path);
  Scenario scenario;
  Section root(path, table);
  root.take("seconds", scenario.seconds);
  root.take("seed", scenario.seed);
  root.take("real_time_factor", scenario.real_time_factor);
  root.take("log", scenario.log);
  root.take("log_air", scenario.logs_air);
  root.take("log_heard", scenario.logs_heard);
  root.take("drift_ppm", scenario.drift_ppm);
  root.take("power_on_spread_ms", scenario.power_on_spread_ms);
  root.take("sample_ms", scenario.sample_ms);
  root.take("baud", scenario.baud);
  root.take("noise_counts", scenario.noise_counts);
  root.take("motor_bias", scenario.motor_bias);
  root.take("motor_noise", scenario.motor_noise);
  scenario.watch = root.texts("watch");
  for (const std::string& text : root.texts("lamp")) scenario.lamp.push_back(parse_lamp(text));
  root.each("medium", [&](Section section) { take_medium(section, scenario.medium); });
  root.each("robot", [&](Section section) { take_robots(section, scenario); });
  root.each("ohc", [&](Section section) { take_ohc(section, scenario); });
  root.refuse_unknown();
  return scenario;
}

}  // namespace swarmtalk::emulator
