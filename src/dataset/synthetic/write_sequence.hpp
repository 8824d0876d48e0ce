#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include "dataset/synthetic/synthetic_source.hpp"

namespace ipl_slam {

/// How a rendered sequence is stored.
struct SequenceWriteOptions {
  bool overwrite = false;            ///< replace a rendered sequence that is there already
  unsigned threads = 0;              ///< frames worked on at the same time; 0 = one per core
  std::string made_by;               ///< the command, noted in the file lists
  std::function<void()> frame_done;  ///< called after each frame, from any thread but never from two at once
};

/// Renders all frames into a folder of the TUM RGB-D layout:
///   rgb/*.png, depth/*.png (16 bit, 5000 per metre), masks/*.png (8 bit, object ids), rgb.txt, depth.txt,
///   masks.txt, associations.txt, groundtruth.txt (T_wc, exact), camera.yaml, objects.json (id, class,
///   moving, moving_frames).
/// It is written beside and renamed, so the folder is complete or not there. Throws UserError when the folder
/// exists (with overwrite: when it is not a rendered sequence) or cannot be written.
void write_sequence(const SyntheticSource& source, const std::filesystem::path& folder,
                    const SequenceWriteOptions& options);

}  // namespace ipl_slam
