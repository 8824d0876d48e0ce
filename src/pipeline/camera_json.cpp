#include "pipeline/camera_json.hpp"

namespace ipl_slam {

nlohmann::ordered_json camera_json(const Camera& c) {
  return {{"name", c.name},
          {"width", c.width},
          {"height", c.height},
          {"fx", c.fx},
          {"fy", c.fy},
          {"cx", c.cx},
          {"cy", c.cy},
          {"k1", c.k1},
          {"k2", c.k2},
          {"p1", c.p1},
          {"p2", c.p2},
          {"k3", c.k3},
          {"depth_scale", c.depth_scale}};
}

}  // namespace ipl_slam
