#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace ipl_slam {

/// An image named by a list, with its time in seconds.
struct ListedImage {
  double timestamp = 0.0;
  std::string file;  ///< as listed: relative to the sequence's folder, or absolute
};

/// A colour image and the depth image registered to it.
struct ListedPair {
  ListedImage color, depth;
};

/// An entry that cannot be used because its timestamp does not come after those before it.
struct MisplacedEntry {
  double timestamp = 0.0;
  double previous = 0.0;  ///< latest timestamp before it in the file
  std::string reason;     ///< "duplicate timestamp" or "backward timestamp"
  std::string detail;     ///< file and line
};

/// What a list of images holds.
struct ImageList {
  std::vector<ListedImage> images;  ///< strictly increasing in time
  std::vector<MisplacedEntry> misplaced;
};

/// What an associations file holds.
struct PairList {
  std::vector<ListedPair> pairs;  ///< colour timestamps strictly increasing
  std::vector<MisplacedEntry> misplaced;
};

/// Reads rgb.txt or depth.txt of the TUM layout: lines "timestamp file", '#' comments; the file's name may
/// hold blanks. Throws UserError (file, line, mend) when the list is missing, empty, or a line cannot be
/// parsed.
[[nodiscard]] ImageList read_image_list(const std::filesystem::path& list);

/// Reads an associations file: lines "timestamp colour-file timestamp depth-file", as the TUM benchmark's
/// tool prints them for rgb.txt and depth.txt. Throws UserError as read_image_list does.
[[nodiscard]] PairList read_associations(const std::filesystem::path& list);

}  // namespace ipl_slam
