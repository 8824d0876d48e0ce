#include "pipeline/config.hpp"

#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "common/options.hpp"
#include "verbs.hpp"

namespace ipl_slam::cli {
namespace {

struct ConfigArguments {
  std::string preset_name = "default";
  std::string file;
  std::vector<std::string> assignments;
  bool markdown = false;
  bool json = false;
};

void print_config(const ConfigArguments& arguments) {
  Config config = preset(arguments.preset_name);
  if (!arguments.file.empty()) load_options(config, arguments.file);
  for (const std::string& assignment : arguments.assignments) set_option(config, assignment);
  check(config);

  const OptionTable table = option_table(config);
  if (arguments.markdown) {
    fmt::print("{}", options_markdown(table));
  } else if (arguments.json) {
    fmt::print("{}\n", options_json(table).dump(2));
  } else {
    fmt::print(
        "# Settings of ipl_slam, preset '{}'. Any part of this file can be given to --config;\n"
        "# keys that are left out keep the preset's values.\n\n{}",
        arguments.preset_name, options_yaml(table));
  }
}

}  // namespace

void add_config_verb(CLI::App& app) {
  CLI::App* verb =
      app.add_subcommand("config", "Print every setting with its meaning, unit and range, as YAML");
  const auto arguments = std::make_shared<ConfigArguments>();
  verb->add_option("--preset", arguments->preset_name,
                   "Values to start from: 'default' (what measured best) or 'paper' (what the paper says)")
      ->type_name("NAME")
      ->capture_default_str();
  verb->add_option("--config", arguments->file, "Check this YAML file and print the values with it applied")
      ->type_name("FILE");
  verb->add_option("--set", arguments->assignments, "Set one value, e.g. orb.features=1200; may be repeated")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  CLI::Option* markdown =
      verb->add_flag("--markdown", arguments->markdown, "Print Markdown tables instead of YAML");
  verb->add_flag("--json", arguments->json, "Print the values as JSON instead of YAML")->excludes(markdown);
  verb->callback([arguments] { print_config(*arguments); });
}

}  // namespace ipl_slam::cli
