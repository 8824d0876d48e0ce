// Settings of every stage: a YAML file, and its lines as words of --set.
#include "common/text_file.hpp"
#include "pipeline/config.hpp"
#include "user_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ipl_slam;
  const auto file = fuzz::user_file("settings.yaml", data, size);
  fuzz::read_or_refuse([&] {
    Config config;
    load_options(config, file);
    check_options(config);
    (void)options_yaml(option_table(config));
  });
  fuzz::read_or_refuse([&] {
    Config config;
    for (const TextLine& line : read_lines(file)) set_option(config, line.text);
  });
  return 0;
}
