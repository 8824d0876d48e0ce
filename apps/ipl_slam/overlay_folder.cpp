#include "overlay_folder.hpp"

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "common/atomic_file.hpp"
#include "pipeline/instance_overlay.hpp"

namespace ipl_slam::cli {

namespace fs = std::filesystem;

OverlayFolder::OverlayFolder(fs::path folder)
    : folder_(std::move(folder)), part_(folder_.string() + ".part") {
  std::error_code error;
  fs::remove_all(part_, error);
  fs::create_directories(part_, error);
  if (error)
    throw UserError(fmt::format("cannot create the folder '{}': {}", part_.string(), error.message()));
}

OverlayFolder::~OverlayFolder() {
  std::error_code ignored;
  fs::remove_all(part_, ignored);
}

void OverlayFolder::add(const RgbdFrame& frame, const std::vector<TrackedInstance>& instances,
                        const std::function<ContourVerdict(InstanceId)>& verdict) const {
  write_image_atomically(part_ / fmt::format("{:.6f}.jpg", frame.timestamp),
                         draw_instances(frame.color, instances, verdict));
}

void OverlayFolder::keep() {
  std::error_code error;
  fs::remove_all(folder_, error);
  fs::rename(part_, folder_, error);
  if (error)
    throw UserError(fmt::format("cannot write the folder '{}': {}", folder_.string(), error.message()));
}

}  // namespace ipl_slam::cli
