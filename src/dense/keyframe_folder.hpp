#pragma once

#include <filesystem>
#include <set>

#include "common/ids.hpp"
#include "dense/view_store.hpp"
#include "geometry/camera.hpp"

namespace ipl_slam {

/// Writes the views of a store into a folder, from which the cloud can be made again:
///   keyframes.json      what belongs to which keyframe: id, timestamp, files, instances; who moved
///   camera.yaml         pinhole(camera), which the images fit
///   rgb/, depth/, masks/    images named by their timestamps; beside a mask what its labels mean
///   rgb.txt, depth.txt, masks.txt
/// It is a sequence in TUM layout itself (TumDataset), with its masks (MaskFolderSegmenter). Folders that are
/// not there are made; files of the same names are replaced, others stay. keyframes.json is removed first and
/// written last, so where it is the folder is whole.
///
/// moved: instances that were found to move at any time. Throws UserError where something cannot be written.
void write_keyframe_folder(const std::filesystem::path& folder, const ViewStore& store,
                           const std::set<InstanceId>& moved, const Camera& camera);

/// Adds the views of a folder to a store, pixel by pixel as they were written, and gives the instances that
/// moved. The store is of the size of the folder's camera.yaml (load_camera) and holds none of the ids.
/// Throws UserError naming the file: missing, broken or of another size, an id given twice, a keyframes.json
/// that is not as written; views read before that stay in the store.
[[nodiscard]] std::set<InstanceId> read_keyframe_folder(const std::filesystem::path& folder,
                                                        ViewStore& store);

}  // namespace ipl_slam
