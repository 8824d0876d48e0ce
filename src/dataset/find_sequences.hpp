#pragma once

#include <filesystem>
#include <vector>

namespace ipl_slam {

/// Folders at or below `root` that hold a sequence in TUM layout: rgb.txt, or a file with ready pairs
/// (associations.txt, associate.txt). Whether it can be read is for TumDataset to say. Sorted by path; links
/// are followed, each folder is taken once, and what lies inside a sequence is not searched. Folders that may
/// not be read are passed over. Throws UserError when `root` is no folder.
[[nodiscard]] std::vector<std::filesystem::path> find_sequences(const std::filesystem::path& root);

}  // namespace ipl_slam
