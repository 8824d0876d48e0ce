#pragma once

#include <string>
#include <vector>

#include "dataset/rgbd_frame.hpp"
#include "segmentation/instance.hpp"

namespace ipl_slam {

/// Finds the instances in an image. An implementation may remember earlier frames, so frames must be given in
/// order of time (some may be left out), and one segmenter serves one sequence.
class Segmenter {
 public:
  virtual ~Segmenter() = default;

  /// The instances of a frame, best score first; colour may be BGR or grey, depth may be empty for a
  /// segmenter that does not need it. Never throws for what is in the picture.
  [[nodiscard]] virtual std::vector<Instance> segment(const RgbdFrame& frame) = 0;
  /// "yolo", "masks" or "geometric".
  [[nodiscard]] virtual std::string name() const = 0;
  /// What its user should know after the last frame, a line each, e.g. that masks were missing.
  [[nodiscard]] virtual std::vector<std::string> remarks() const { return {}; }
};

}  // namespace ipl_slam
