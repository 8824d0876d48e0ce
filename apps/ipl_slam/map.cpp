#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "cloud_outputs.hpp"
#include "common/atomic_file.hpp"
#include "common/log.hpp"
#include "common/progress.hpp"
#include "map/map_bytes.hpp"
#include "map/map_file.hpp"
#include "output.hpp"
#include "pipeline/dense_views.hpp"
#include "pipeline/lines_ply.hpp"
#include "pipeline/map_export.hpp"
#include "pipeline/map_view.hpp"
#include "sequence_options.hpp"
#include "verbs.hpp"

namespace ipl_slam::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct InfoArguments {
  std::string file;
  bool json = false;
};

struct ExportArguments {
  std::string file, output;
  std::vector<std::string> keyframes;
  CloudOutputs cloud;
  SequenceOptions settings;
};

void print_summary(const Json& info) {
  const Json& camera = info["camera"];
  fmt::print("{}: map of format version {}, {:.1f} MB\n", info["file"].get<std::string>(),
             info["format_version"].get<std::uint32_t>(), info["bytes"].get<double>() / 1e6);
  fmt::print("camera      {}, {}x{}, fx {:g} fy {:g} cx {:g} cy {:g}\n", camera["name"].get<std::string>(),
             camera["width"].get<int>(), camera["height"].get<int>(), camera["fx"].get<double>(),
             camera["fy"].get<double>(), camera["cx"].get<double>(), camera["cy"].get<double>());
  for (const auto& [label, key] : {std::pair("keyframes", "keyframes"),
                                   {"points", "points"},
                                   {"lines", "lines"},
                                   {"loop edges", "loop_edges"}}) {
    fmt::print("{:<11} {}\n", label, info[key].get<std::size_t>());
  }
  fmt::print("parts       {}\n", info["parts"].size());
  for (const Json& part : info["parts"]) {
    const auto extent = [&](std::size_t axis) {
      return part["high"][axis].get<double>() - part["low"][axis].get<double>();
    };
    const double first = part["first_time"], last = part["last_time"];
    fmt::print(
        "  part {}    {} keyframes, {} points, {} lines; {:.1f} x {:.1f} x {:.1f} m (x y z); {:.1f} s from "
        "{:.3f}\n",
        part["part"].get<std::uint32_t>(), part["keyframes"].get<std::size_t>(),
        part["points"].get<std::size_t>(), part["lines"].get<std::size_t>(), extent(0), extent(1), extent(2),
        last - first, first);
  }
}

void print_info(const InfoArguments& arguments) {
  const SavedMap saved = load_map(arguments.file);
  Json info{{"file", arguments.file},
            {"bytes", fs::file_size(arguments.file)},
            {"format_version", map_format().version}};
  info.update(map_summary(saved));
  if (arguments.json) {
    fmt::print("{}", json_text(info));
  } else {
    print_summary(info);
  }
}

struct KeyframeCloud {
  DenseMap dense;
  DenseMap::Result fused = {};
};

// The cloud of the keyframes in one part of the map, with the poses they have there now.
std::unique_ptr<KeyframeCloud> fuse(const ExportArguments& arguments, const SavedMap& saved, PartId part,
                                    const DenseOptions& options) {
  std::unique_ptr<KeyframeCloud> cloud(new KeyframeCloud{DenseMap(saved.camera, options)});
  DenseMap& dense = cloud->dense;
  KeptKeyframes kept;
  for (const std::string& folder : arguments.keyframes) {
    kept.merge(dense.add(folder));
  }
  const std::map<KeyframeId, ViewSituation> situations = situations_of(kept, saved.map, part);
  if (situations.empty()) {
    throw UserError(
        fmt::format("none of the {} keyframes in '{}' belongs to part {} of '{}': give the folder that "
                    "`run --save-keyframes` wrote beside that map",
                    kept.size(), fmt::join(arguments.keyframes, "', '"), part.value, arguments.file));
  }
  if (situations.size() < kept.size()) {
    log().warn("{} of {} keyframes do not belong to part {} of the map (of another run?) and are left out",
               kept.size() - situations.size(), kept.size(), part.value);
  }
  std::optional<ProgressBar> bar;
  if (says_remarks()) bar.emplace("fusing", 3 * situations.size(), "steps");
  const auto progress = [&] {
    if (bar) bar->advance();
  };
  dense.follow(situations, 0.0, situations.size(), progress);
  cloud->fused = dense.cloud(progress);
  if (dense.volume().refused() > 0) {
    log().warn(
        "the cloud is cut short at dense.volume.max_memory: raise that, or dense.volume.voxel and "
        "truncation");
  }
  return cloud;
}

// What is given twice would count twice, and results among the keyframes would spoil them.
void check_folders(const std::vector<std::string>& folders, const std::string& output) {
  std::error_code error;
  for (std::size_t i = 0; i < folders.size(); ++i) {
    if (fs::equivalent(folders[i], output, error)) {
      throw UserError(
          fmt::format("'{}' holds the keyframes themselves; choose another folder with -o", output));
    }
    for (std::size_t k = 0; k < i; ++k) {
      if (fs::equivalent(folders[i], folders[k], error)) {
        throw UserError(fmt::format("--keyframes '{}' is given twice", folders[i]));
      }
    }
  }
}

void export_map(const ExportArguments& arguments) {
  if (arguments.keyframes.empty() && arguments.cloud.any()) {
    throw UserError(
        "clouds, meshes and occupancy are made of the keyframes' images: give --keyframes FOLDER");
  }
  arguments.cloud.check();
  check_folders(arguments.keyframes, arguments.output);
  const Config config = arguments.settings.load_config();
  const SavedMap saved = load_map(arguments.file);
  const Map& map = saved.map;
  const std::vector<TrajectoryPart> keyframes = keyframe_parts(map);
  const TrajectoryPart& main = keyframes.front();
  // Before anything is written: the folders of keyframes may not fit the map.
  const auto cloud = arguments.keyframes.empty() ? nullptr : fuse(arguments, saved, main.part, config.dense);
  const fs::path folder = arguments.output;
  make_folder(folder);
  CloudOutputs::clear(folder);
  write_trajectory(folder / "keyframes.txt", keyframes);
  write_file_atomically(folder / "points.ply", points_ply(map));
  write_file_atomically(folder / "lines.ply", lines_ply(map));
  write_file_atomically(folder / "graph.json", json_text(map_graph(map)));
  write_image_atomically(folder / "map.png", draw_map_view(map, main));
  log().info("wrote keyframes.txt, points.ply, lines.ply, graph.json and map.png to {}", folder.string());
  if (!cloud) return;
  const std::vector<std::string> names =
      arguments.cloud.write(folder, cloud->fused, cloud->dense, main.poses);
  log().info("wrote {}: {} points, {} objects", fmt::join(names, ", "), cloud->fused.cloud.points.size(),
             cloud->fused.objects.size());
}

}  // namespace

void add_map_verb(CLI::App& app) {
  CLI::App* verb =
      app.add_subcommand("map", "Look into a saved map, or turn it into files for other programs");
  verb->require_subcommand(1);

  CLI::App* info = verb->add_subcommand("info", "Say what a map holds");
  const auto shown = std::make_shared<InfoArguments>();
  info->add_option("map", shown->file, "Map that was saved")->type_name("FILE")->required();
  info->add_flag("--json", shown->json, "Print it as JSON");
  info->callback([shown] { print_info(*shown); });

  CLI::App* exported = verb->add_subcommand(
      "export",
      "Write keyframes.txt (TUM), points.ply, lines.ply, graph.json and map.png, and with --keyframes the "
      "dense cloud: cloud.ply and objects.json");
  const auto arguments = std::make_shared<ExportArguments>();
  exported->add_option("map", arguments->file, "Map that was saved")->type_name("FILE")->required();
  exported->add_option("-o,--output", arguments->output, "Folder for the files; made where it is not there")
      ->type_name("DIR")
      ->required();
  exported
      ->add_option(
          "--keyframes", arguments->keyframes,
          "Folder of the keyframes' images that `run --save-keyframes` wrote with this map; may be given "
          "again")
      ->type_name("FOLDER")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  arguments->cloud.add_to(*exported);
  arguments->settings.add_settings_to(*exported);
  exported->callback([arguments] { export_map(*arguments); });
}

}  // namespace ipl_slam::cli
