#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "common/ids.hpp"
#include "dense/view_store.hpp"
#include "geometry/camera.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

/// A keyframe whose view is kept in a folder, beside that view.
struct KeptKeyframe {
  /// The keyframe of the map that its pose hangs on, by what tells it from all others: its time (s) and the
  /// fingerprint of its descriptors. Itself while it is in the map.
  double reference_time = 0.0;
  std::string reference_fingerprint;
  SE3 T_c_reference;
  std::set<InstanceId> moved;  ///< who is to be left out of it because they moved

  friend bool operator==(const KeptKeyframe& a, const KeptKeyframe& b) {
    return a.reference_time == b.reference_time && a.reference_fingerprint == b.reference_fingerprint &&
           a.moved == b.moved && a.T_c_reference.translation() == b.T_c_reference.translation() &&
           a.T_c_reference.rotation().coeffs() == b.T_c_reference.rotation().coeffs();
  }
};

using KeptKeyframes = std::map<KeyframeId, KeptKeyframe>;

/// Writes the views of these keyframes into a folder, from which, with the map, the cloud can be made again:
///   keyframes.json      what belongs to which keyframe
///   camera.yaml         pinhole(camera), which the images fit
///   rgb/, depth/, masks/    images named by their timestamps; beside a mask what its labels mean
///   rgb.txt, depth.txt, masks.txt
/// It is a sequence in TUM layout itself (TumDataset), with its masks (MaskFolderSegmenter). Folders that are
/// not there are made; files of the same names are replaced, others stay. Until the folder is whole its
/// keyframes.json lists none and is refused. Throws UserError where something cannot be written.
void write_keyframe_folder(const std::filesystem::path& folder, const ViewStore& store,
                           const KeptKeyframes& kept, const Camera& camera);

/// Adds the views of a folder to a store, pixel by pixel as they were written. Keyframes are numbered anew,
/// in the order of the folder, behind those that the store holds; so are instances, if it holds any. The
/// store is of the size of the folder's images. Throws UserError naming the file: missing, broken or of
/// another size, a keyframes.json that is not as written; views read before that stay in the store.
[[nodiscard]] KeptKeyframes read_keyframe_folder(const std::filesystem::path& folder, ViewStore& store);

/// Takes away what write_keyframe_folder() wrote, if it did: other files stay.
void clear_keyframe_folder(const std::filesystem::path& folder);

}  // namespace ipl_slam
