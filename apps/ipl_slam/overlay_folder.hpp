#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "dataset/rgbd_frame.hpp"
#include "dynamics/contour_window.hpp"
#include "segmentation/instance.hpp"

namespace ipl_slam::cli {

/// Pictures of what was seen, one JPEG per frame named by its timestamp. They are written beside, into a
/// folder of the same name with ".part" added, which takes the place of the folder in keep(); without keep()
/// nothing changes.
class OverlayFolder {
 public:
  /// Throws UserError when it cannot be written.
  explicit OverlayFolder(std::filesystem::path folder);
  ~OverlayFolder();
  OverlayFolder(const OverlayFolder&) = delete;
  OverlayFolder& operator=(const OverlayFolder&) = delete;

  void add(const RgbdFrame& frame, const std::vector<TrackedInstance>& instances,
           const std::function<ContourVerdict(InstanceId)>& verdict = {}) const;
  /// Replaces what stood at the folder before.
  void keep();

 private:
  std::filesystem::path folder_, part_;
};

}  // namespace ipl_slam::cli
