#include "segmentation/geometric_segmenter.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

#include "segmentation/cell_regions.hpp"

namespace ipl_slam {

namespace {

Camera checked(const Camera& camera) {
  camera.check();
  return camera;
}

GeometricOptions checked(const GeometricOptions& options) {
  check_options(options);
  return options;
}

cv::Mat to_grey(const cv::Mat& color) {
  if (color.type() == CV_8UC1) return color;
  cv::Mat grey;
  cv::cvtColor(color, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

void check_frame(const RgbdFrame& frame, cv::Size size) {
  if (frame.color.size() != size || frame.depth.size() != size || frame.depth.type() != CV_16UC1 ||
      (frame.color.type() != CV_8UC1 && frame.color.type() != CV_8UC3)) {
    throw std::invalid_argument("geometric segmenter: images do not fit the camera, or have the wrong type");
  }
}

}  // namespace

GeometricSegmenter::GeometricSegmenter(const Camera& camera, const GeometricOptions& options,
                                       std::uint64_t seed)
    : options_(checked(options)),
      grid_(checked(camera), options.grid_width),
      camera_motion_(camera, options.camera_motion, seed),
      free_space_(grid_, options.free_space),
      belief_(grid_, options.belief) {}

std::vector<Instance> GeometricSegmenter::segment(const RgbdFrame& frame) {
  check_frame(frame, grid_.image_size());
  const cv::Mat grey = to_grey(frame.color);
  const GridFrame cells = grid_.reduce(grey, frame.depth);
  cv::Mat moving = cv::Mat::zeros(grid_.size(), CV_8UC1);
  std::vector<Instance> found;

  T_wc_ = camera_motion_.track(grey, frame.depth, frame.timestamp);
  if (T_wc_) {
    last_evidence_ = free_space_.evidence(cells.inverse_depth, *T_wc_);
    FreeSpaceView view(cells.inverse_depth, *T_wc_, options_.free_space.tolerance);
    const Conductance conductance = surface_conductance(cells, grid_, options_.belief);
    last_belief_ = belief_.update(cells, *T_wc_, frame.timestamp, last_evidence_, conductance, view).clone();
    found = instances(last_belief_, cells, frame.depth, conductance, moving);
    view.distrust(moving);
    free_space_.add(view, frame.timestamp);
  } else {
    free_space_.clear();
    belief_.clear();
  }
  camera_motion_.renew_landmarks(moving);
  return found;
}

std::vector<Instance> GeometricSegmenter::instances(const cv::Mat& belief, const GridFrame& frame,
                                                    const cv::Mat& depth, const Conductance& conductance,
                                                    cv::Mat& moving) const {
  cv::Mat labels;
  std::vector<Instance> found;
  for (const CellRegion& region :
       connected_regions(belief > options_.threshold, conductance, options_.min_conductance, labels)) {
    if (region.area < options_.min_area * grid_.size().area()) continue;
    const cv::Mat cells = labels == region.label;
    moving |= cells;
    Instance instance;
    instance.class_name = "unknown";
    instance.score = static_cast<float>((1.0 + cv::mean(belief, cells)[0]) / 2.0);
    instance.mask = region_mask(region, labels, frame, depth, grid_);
    instance.box = instance.mask.bounding_box();
    if (!instance.box.empty()) found.push_back(std::move(instance));
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Instance& a, const Instance& b) { return a.score > b.score; });
  return found;
}

}  // namespace ipl_slam
