#include "pipeline/lines_ply.hpp"

#include <fmt/format.h>

#include "map/landmark_part.hpp"

namespace ipl_slam {

std::string lines_ply(const Map& map) {
  std::string vertices, edges;
  std::size_t count = 0;
  map.lines().for_each([&](LineId id, const Line& line) {
    for (const Eigen::Vector3d& p : {line.start, line.end}) {
      vertices += fmt::format("{:.6f} {:.6f} {:.6f}\n", p.x(), p.y(), p.z());
    }
    edges += fmt::format("{} {} {} {} {}\n", 2 * count, 2 * count + 1, id.value, line.observations.size(),
                         part_of(map, line).value);
    ++count;
  });
  return fmt::format(
             "ply\n"
             "format ascii 1.0\n"
             "comment line landmarks of ipl_slam, world frame, metres\n"
             "element vertex {}\n"
             "property double x\n"
             "property double y\n"
             "property double z\n"
             "element edge {}\n"
             "property int vertex1\n"
             "property int vertex2\n"
             "property int id\n"
             "property int observations\n"
             "property int part\n"
             "end_header\n",
             2 * count, count) +
         vertices + edges;
}

}  // namespace ipl_slam
