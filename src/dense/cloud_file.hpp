#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "dense/semantic_cloud.hpp"
#include "dense/triangle_mesh.hpp"

namespace ipl_slam {

/// A cloud as PLY (binary_little_endian 1.0), which MeshLab, CloudCompare and Open3D read. Per vertex: float
/// x y z nx ny nz, uchar red green blue, int label (-1 = none), float confidence. World frame, metres. The
/// legend stands in the comments, one class each: "comment label 56 chair 255 0 0".
[[nodiscard]] std::string cloud_ply(const SemanticCloud& cloud, CloudColors colors = CloudColors::kImage);

/// The same as PCD v0.7 (binary), which PCL and rviz read. Fields x y z rgb normal_x normal_y normal_z label
/// confidence; rgb is packed as PCL does, 0x00rrggbb in the bytes of a float; label is an int.
[[nodiscard]] std::string cloud_pcd(const SemanticCloud& cloud, CloudColors colors = CloudColors::kImage);

/// A mesh as PLY (binary_little_endian 1.0): float x y z, uchar red green blue per vertex; list uchar int
/// vertex_indices per face. World frame, metres.
[[nodiscard]] std::string mesh_ply(const TriangleMesh& mesh);

/// {"legend": [{label, class, color}], "objects": [{label, class, confidence, centre, low, high, views,
/// points}]}; positions in the world, m, rounded to 0.1 mm; colours 0 to 255, red first.
[[nodiscard]] nlohmann::ordered_json objects_json(const std::vector<CloudObject>& objects,
                                                  const std::vector<CloudClass>& classes);

/// Reads a cloud that this program or another wrote: PLY (ASCII, binary of either byte order) or PCD (ASCII,
/// binary). The content decides, not the name. Only x y z must be there; colours (red green blue, also
/// diffuse_* or r g b, floating-point ones from 0 to 1, or PCL's packed rgb), normals, label and confidence
/// are taken where they are, all else is skipped. Points that are not finite are left out. Points without
/// colour are grey; classes without a legend are called "class 7". Throws UserError for what is no such
/// file or is cut short.
[[nodiscard]] SemanticCloud read_cloud(const std::filesystem::path& file);

}  // namespace ipl_slam
