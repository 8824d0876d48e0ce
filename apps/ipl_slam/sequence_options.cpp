#include "sequence_options.hpp"

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "dataset/camera_config.hpp"

namespace ipl_slam::cli {

void SequenceOptions::add_to(CLI::App& verb) {
  verb.add_option("sequence", folder,
                  "Folder in TUM RGB-D layout (rgb.txt and depth.txt, or associations.txt)")
      ->required();
  verb.add_option(
      "--camera", camera,
      "Camera: tum1, tum2, tum3, bonn or a YAML file; default: camera.yaml in the folder, or by its name");
  verb.add_option("--preset", preset, "Settings to start from: default or paper")->capture_default_str();
  verb.add_option("--config", config_file, "YAML file with settings that differ (see 'ipl_slam config')");
  verb.add_option("--set", settings,
                  "One setting, KEY=VALUE, e.g. --set orb.features=1500; may be given again")
      ->type_name("KEY=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  verb.add_option("--associations", dataset.associations,
                  "File with ready colour-depth pairs, in the folder or elsewhere");
  verb.add_option("--max-frames", max_frames, "Stop after this many frames; 0 = all")->capture_default_str();
}

Camera SequenceOptions::load_camera() const {
  if (!camera.empty()) return ipl_slam::load_camera(camera);
  if (!std::filesystem::is_directory(folder)) {
    throw UserError(
        fmt::format("{}: no such folder; give the folder that holds rgb.txt and depth.txt", folder.string()));
  }
  const auto guess = guess_camera(folder);
  if (!guess) {
    throw UserError(
        fmt::format("{}: cannot tell the camera from the folder's name; give --camera tum1, tum2, tum3, "
                    "bonn or a YAML file",
                    folder.string()));
  }
  const Camera found = ipl_slam::load_camera(*guess);
  fmt::print("camera: {} (guessed from the folder; --camera chooses another)\n", *guess);
  return found;
}

Config SequenceOptions::load_config() const {
  Config config = ipl_slam::preset(preset);
  if (!config_file.empty()) load_options(config, config_file);
  for (const std::string& setting : settings) set_option(config, setting);
  return config;
}

}  // namespace ipl_slam::cli
