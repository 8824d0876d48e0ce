#include "sequence_options.hpp"

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "dataset/camera_config.hpp"
#include "output.hpp"

namespace ipl_slam::cli {

CLI::Validator not_empty() {
  return {[](const std::string& word) { return word.empty() ? "a path is wanted, not nothing" : ""; }, ""};
}

void SequenceOptions::add_to(CLI::App& verb, const std::string& folder_meaning) {
  verb.add_option("sequence", folder, folder_meaning)->type_name("FOLDER")->check(not_empty())->required();
  verb.add_option("--camera", camera,
                  "tum1, tum2, tum3, bonn or a YAML file (default: camera.yaml in the sequence's folder, or "
                  "what its name says)")
      ->type_name("NAME|FILE");
  verb.add_option("--preset", preset,
                  "Settings to start from: default (what measured best) or paper (what the paper says)")
      ->type_name("NAME")
      ->capture_default_str();
  add_settings_to(verb);
  add_max_frames_to(verb);
  verb.add_option("--associations", dataset.associations,
                  "File with ready color-depth pairs, in the sequence's folder or elsewhere")
      ->type_name("FILE");
}

void SequenceOptions::add_settings_to(CLI::App& verb) {
  verb.add_option("--config", config_file, "YAML file with settings that differ (see 'ipl_slam config')")
      ->type_name("FILE");
  verb.add_option("--set", settings,
                  "One setting, KEY=VALUE, e.g. --set orb.features=1500; may be given again")
      ->type_name("KEY=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void SequenceOptions::add_max_frames_to(CLI::App& verb) {
  verb.add_option("--max-frames", max_frames, "Stop after this many frames; 0 = all")
      ->type_name("N")
      ->check(CLI::Range(0, 1000000000))
      ->capture_default_str();
}

Camera SequenceOptions::load_camera() const {
  if (!camera.empty()) return ipl_slam::load_camera(camera);
  // A wrong folder is to be told as that, not as one whose camera is unknown.
  (void)TumDataset(folder, Camera{}, dataset_options());
  const auto guess = guess_camera(folder);
  if (!guess) {
    throw UserError(fmt::format(
        "'{}': cannot tell the camera from the folder's name; put a camera.yaml into the folder or give "
        "--camera tum1, tum2, tum3, bonn or a YAML file",
        folder.string()));
  }
  const Camera found = ipl_slam::load_camera(*guess);
  if (says_remarks()) {
    const bool file = std::filesystem::path(*guess).has_extension();
    fmt::print("camera: {} ({}; --camera chooses another)\n", *guess,
               file ? "found in the folder" : "guessed from the folder's name");
  }
  return found;
}

TumDatasetOptions SequenceOptions::dataset_options() const {
  TumDatasetOptions resolved = dataset;
  const std::filesystem::path& file = dataset.associations;
  std::error_code error;
  if (!file.empty() && !std::filesystem::exists(folder / file, error) &&
      std::filesystem::exists(file, error)) {
    resolved.associations = std::filesystem::absolute(file).string();
  }
  return resolved;
}

void SequenceOptions::check_output(const std::filesystem::path& output) const {
  std::error_code error;
  if (std::filesystem::equivalent(folder, output, error)) {
    throw UserError(
        fmt::format("'{}' is the sequence itself; choose another folder with -o", output.string()));
  }
  check_kept(folder, output);
}

void check_kept(const std::filesystem::path& input, const std::filesystem::path& output) {
  std::error_code error;
  const std::filesystem::path keyframes = output / "keyframes";
  if (std::filesystem::equivalent(input, keyframes, error) ||
      std::filesystem::equivalent(input, keyframes / "masks", error)) {
    throw UserError(
        fmt::format("'{}' was left in '{}' by an earlier run, and a new one takes its place: move it, "
                    "or choose another folder with -o",
                    input.string(), output.string()));
  }
}

Config SequenceOptions::load_config() const {
  Config config = ipl_slam::preset(preset);
  if (!config_file.empty()) load_options(config, config_file);
  for (const std::string& setting : settings) set_option(config, setting);
  check(config);
  return config;
}

}  // namespace ipl_slam::cli
