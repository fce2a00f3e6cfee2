#include <nlohmann/json.hpp>

#include "usage/usage.hpp"

namespace swarmtalk::usage {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const CLI::Option& option) {
  Json names = Json::array();
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  const bool takes_value = option.get_items_expected_max() > 0;
  return {{"names", names},
          {"positional", option.nonpositional() ? "" : option.get_name(true)},
          {"value", takes_value ? option.get_type_name() : ""},
          {"repeated", option.get_items_expected_max() > 1},
          {"required", option.get_required()},
          {"default", takes_value ? option.get_default_str() : ""},
          {"text", option.get_description()}};
}

Json json_of(const CLI::App& app) {
  Json options = Json::array();
  for (const CLI::Option* option : app.get_options([](const CLI::Option* each) {
         return !each->get_group().empty();  // the others are hidden
       })) {
    options.push_back(json_of(*option));
  }
  Json commands = Json::array();
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    commands.push_back(json_of(*command));
  }
  return {
      {"name", app.get_name()},     {"aliases", app.get_aliases()}, {"text", app.get_description()},
      {"footer", app.get_footer()}, {"options", options},           {"commands", commands}};
}

}  // namespace

std::string describe(const CLI::App& app) {
  return json_of(app).dump(1);
}

}  // namespace swarmtalk::usage
