#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "dataset/rgbd_frame.hpp"
#include "dense/dense_map.hpp"
#include "pipeline/config.hpp"
#include "pipeline/dense_views.hpp"
#include "segmentation/instance.hpp"

namespace ipl_slam {

/// A keyframe for the dense map: images as they come from the camera.
struct NewView {
  KeyframeId id;
  RgbdFrame frame;
  std::vector<TrackedInstance> instances;
  KeptView kept;
};

/// Where and when the dense map is worked on. The stages before it do not know.
class DenseSchedule {
 public:
  virtual ~DenseSchedule() = default;

  /// Where the disk fails it keeps that for check() and takes no more views: what is tracked is not to be
  /// lost for it.
  virtual void add(NewView view) = 0;
  /// Waits for what is under way. To be called before what follows.
  virtual void finish() = 0;
  /// Throws what went wrong with a view: UserError where the disk failed.
  virtual void check() const = 0;
  [[nodiscard]] virtual DenseMap& dense() = 0;
  [[nodiscard]] virtual const DenseMap& dense() const = 0;
  [[nodiscard]] virtual const DenseViews& views() const = 0;
  /// Keyframes whose views were dropped because others waited.
  [[nodiscard]] virtual std::size_t dropped() const = 0;
};

/// Calls its argument with the map while the mapper rests.
using ReadMap = std::function<void(const std::function<void(const Map&)>&)>;

/// In lockstep views are kept, and the volume is made when all poses are known. In realtime a thread takes
/// the views in as they come and follows the map with as many others as the settings allow.
[[nodiscard]] std::unique_ptr<DenseSchedule> make_dense_schedule(const Camera& camera, const Config& config,
                                                                 ReadMap read_map);

}  // namespace ipl_slam
