#include "cloud_outputs.hpp"

#include <memory>
#include <optional>

#include <ipl_slam/error.hpp>

#include "common/atomic_file.hpp"
#include "common/log.hpp"
#include "dense/cloud_file.hpp"
#include "dense/occupancy_grid.hpp"
#include "dense/occupancy_map.hpp"
#include "dense/octomap_file.hpp"
#include "dense/upright.hpp"
#include "output.hpp"

namespace ipl_slam::cli {
namespace {

// What the views of the volume saw through and what stands there, upright.
OccupancyGrid occupancy_of(const DenseMap& dense, const SemanticCloud& cloud, const Trajectory& trajectory) {
  const DenseOptions& options = dense.options();
  const Upright upright = upright_frame(cloud, trajectory, options.upright);
  if (!upright.floor_was_found) {
    log().warn("no floor was found in the cloud: heights in the floor plan count from its lowest points");
  }
  OccupancyGrid grid(options.occupancy, upright.T_uw);
  grid.add_points(cloud.points);
  for (const KeyframeId id : dense.views().ids()) {
    const ViewSituation* situation = dense.in_volume(id);
    if (situation == nullptr) continue;
    grid.add_rays(dense.range_image(id, situation->moved), dense.camera(), situation->T_cw.inverse());
  }
  return grid;
}

}  // namespace

void CloudOutputs::add_to(CLI::App& verb) {
  verb.add_flag(
      "--label-colors", label_colors,
      "Colour what has a class by its class in cloud.ply (legend: objects.json and the file's head)");
  verb.add_flag("--pcd", pcd, "Write the cloud as cloud.pcd, too");
  verb.add_flag("--mesh", mesh, "Write its surface as triangles to mesh.ply");
  verb.add_flag("--occupancy", occupancy,
                "Write a floor plan of free and occupied cells for ROS's map_server: map.pgm and map.yaml");
  verb.add_flag("--octomap", octomap, "Write free and occupied cells as an OctoMap: map.bt");
}

void CloudOutputs::clear(const std::filesystem::path& folder) {
  std::error_code ignored;
  for (const char* name :
       {"cloud.ply", "objects.json", "cloud.pcd", "mesh.ply", "map.pgm", "map.yaml", "map.bt"}) {
    std::filesystem::remove(folder / name, ignored);
  }
}

void CloudOutputs::check() const {
  if (octomap && !has_octomap()) (void)octomap_bt(OccupancyGrid({}));  // says so
}

std::vector<std::string> CloudOutputs::write(const std::filesystem::path& folder,
                                             const DenseMap::Result& fused, const DenseMap& dense,
                                             const Trajectory& trajectory) const {
  std::vector<std::string> names;
  const auto write_as = [&](const char* name, const std::string& content) {
    write_file_atomically(folder / name, content);
    names.emplace_back(name);
  };
  const SemanticCloud& cloud = fused.cloud;
  if (label_colors && cloud.classes.empty()) {
    log().warn(
        "--label-colors: nothing in the cloud has a class; classes come from a network (--model) or from "
        "masks "
        "with a list of classes");
  }
  const CloudColors colors = label_colors ? CloudColors::kLabels : CloudColors::kImage;
  write_as("cloud.ply", cloud_ply(cloud, colors));
  write_as("objects.json", json_text(objects_json(fused.objects, cloud.classes)));
  if (pcd) write_as("cloud.pcd", cloud_pcd(cloud, colors));
  if (mesh) write_as("mesh.ply", mesh_ply(dense.mesh(cloud)));
  if (!occupancy && !octomap) return names;
  const OccupancyGrid grid = occupancy_of(dense, cloud, trajectory);
  if (octomap) write_as("map.bt", octomap_bt(grid));
  if (occupancy) {
    try {
      const OccupancyMap map = occupancy_map(grid, dense.options().floor_plan);
      write_as("map.pgm", map_pgm(map));
      write_as("map.yaml", map_yaml(map, "map.pgm"));
    } catch (const UserError& error) {
      log().warn("no floor plan: {}", error.what());  // the rest is not to be lost for it
    }
  }
  return names;
}

}  // namespace ipl_slam::cli
