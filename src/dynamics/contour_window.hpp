#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include <ipl_slam/motion_state.hpp>

#include "common/ids.hpp"
#include "common/options.hpp"
#include "dynamics/carried_comparison.hpp"
#include "dynamics/record_table.hpp"
#include "geometry/camera.hpp"
#include "geometry/se3.hpp"
#include "segmentation/instance.hpp"

namespace ipl_slam {

/// With the paper's values (paper_contour_window) the masks of a real segmenter are all judged moving: the Hu
/// invariants of noisy outlines keep the similarity of still objects below 0.85, and a moving camera does the
/// rest. The defaults are the middle of the gap between people who walk and what stays (docs/method.md).
struct ContourWindowOptions {
  int window = 20;          ///< source frames over which an instance is judged
  int pair_gap = 10;        ///< source frames between the masks of a pair
  int tolerance = 5;        ///< source frames by which a pair's gap may differ where frames have no masks
  int minimum_pairs = 3;    ///< pairs from which on an instance is judged
  int sparse_window = 60;   ///< source frames to which a window of fewer pairs stretches; 0: it does not
  double threshold = 0.65;  ///< similarity over the window below this is motion
  double movable_threshold = 0.5;  ///< the same for classes that do not move by themselves (class_role.hpp)
  double iou_weight = 1.0;         ///< share of IoU in the similarity, the rest is that of the Hu invariants
  bool robust = true;        ///< the window's similarity is the median without the two lowest, else the mean
  bool compensate = true;    ///< carry masks along with the camera's motion before they are compared
  bool record_table = true;  ///< known movers are moving at once, without analysis
  int forget_after = 300;    ///< source frames after which an instance that is not seen is forgotten
  CarriedComparisonOptions carried;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("window", window, {2, 1000, "frames", "source frames over which an instance is judged"});
    v.number("pair_gap", pair_gap, {1, 1000, "frames", "source frames between the masks of a pair"});
    v.number("tolerance", tolerance,
             {0, 1000, "frames", "by which the gap of a pair may differ where not every frame has masks"});
    v.number("minimum_pairs", minimum_pairs,
             {1, 1000, "count", "pairs from which on an instance is judged; until then it is a candidate"});
    v.number(
        "sparse_window", sparse_window,
        {0, 1000, "frames",
         "to which the window stretches, and the gap of a pair may grow, where masks are too rare for it; "
         "0 switches this off"});
    v.number("threshold", threshold,
             {0.0, 1.0, "1", "similarity of the contours over the window below this is motion"});
    v.number(
        "movable_threshold", movable_threshold,
        {0.0, 1.0, "1", "the same for what does not move by itself: all but people, animals and vehicles"});
    v.number(
        "iou_weight", iou_weight,
        {0.0, 1.0, "1", "share of the overlap in the similarity; the rest is that of the Hu invariants"});
    v.flag(
        "robust", robust,
        "similarity over the window = median of its pairs without the two lowest, which one bad mask cannot "
        "change; off: their mean");
    v.flag(
        "compensate", compensate,
        "carry the earlier mask into the current view with its depth and the camera's motion; off: compare "
        "the masks as they lie in the image");
    v.flag("record_table", record_table,
           "known movers are moving at once in each new frame, without analysis");
    v.number("forget_after", forget_after,
             {1, 1e6, "frames", "after which an instance that is not seen any more is forgotten"});
    v.section("carried", carried, "comparison of masks with the camera's motion removed");
  }
};

/// The values of the paper, and its comparison of masks as they lie in the image. Every frame needs masks, or
/// every second, fifth or tenth: pairs are exactly 10 frames apart.
[[nodiscard]] ContourWindowOptions paper_contour_window();

/// Throws UserError for values with which nothing could ever be judged, though each is in its range. Keys are
/// named as in the settings' section "contours".
void check(const ContourWindowOptions& options);

/// What is given of a frame.
struct ContourFrame {
  std::size_t index = 0;  ///< number of the source frame; strictly increasing, gaps are allowed
  std::vector<TrackedInstance> instances;  ///< those with frames_carried == 0 are evidence
  cv::Mat depth;            ///< CV_16UC1, raw; shared, not copied: not to be written to afterwards
  std::optional<SE3> T_wc;  ///< camera to world; nothing where the camera is lost
};

struct ContourVerdict {
  InstanceId id;
  MotionState state = MotionState::kCandidate;
  std::optional<double> similarity;  ///< over the window, or of the last check of a known mover
};

/// The masks of an instance in the frames first .. last (both included) are dynamic.
struct DynamicSpan {
  InstanceId id;
  std::size_t first = 0, last = 0;
};

struct ContourVerdicts {
  std::vector<ContourVerdict> verdicts;  ///< one per instance of the frame, in its order
  std::vector<DynamicSpan> dynamic;      ///< marks, also of frames that have passed; they may repeat

  /// The verdict on an instance of the frame; on any other that it is a candidate.
  [[nodiscard]] ContourVerdict of(InstanceId id) const;
};

/// Tells which instances moved, by the similarity of their masks inside a sliding window (paper,
/// section 3.3).
///
/// In a window of 20 frames every mask is compared with the one 10 frames before it and the last with the
/// first. A mean similarity below the threshold is motion, and all masks of the window are marked dynamic.
/// The window is measured in source frames; where not every frame has masks, pairs take the nearest that has.
/// Where masks are so rare that the window holds fewer than `minimum_pairs`, it stretches until it does: a
/// pair's gap grows to the next mask before, and older pairs stay, up to `sparse_window`.
///
/// An instance that was found moving enters the record table: from then on it is moving at once, also when it
/// comes back under its id, and only one pair per `pair_gap` frames is still looked at. When these pairs were
/// all at the threshold or above over a whole window, the instance is still again.
class ContourWindow {
 public:
  ContourWindow(const Camera& camera, const ContourWindowOptions& options);

  /// Judges the instances of the next frame. Throws std::invalid_argument where frames are not in order.
  [[nodiscard]] ContourVerdicts process(const ContourFrame& frame);

 private:
  struct View {
    std::size_t frame;
    InstanceView seen;
  };
  struct Pair {
    std::size_t earlier, later;  // frames
    double similarity;
  };
  struct Track {
    std::size_t first_seen = 0, last_seen = 0;
    std::deque<Pair> pairs;  // about pair_gap apart
    ContourVerdict verdict;
  };

  [[nodiscard]] Track& track_of(InstanceId id, std::size_t now);
  // Of an instance of the newest view: judged by the window, or only checked. To judge gives the first frame
  // of the window, nothing where there was too little to judge by.
  std::optional<std::size_t> judge(Track& track, std::size_t instance);
  void check_known_mover(Track& track, std::size_t instance);
  // The view with a mask of the track in a frame from `first_seen` to before `end` that is the nearest to
  // `gap` frames ago, else the next one before.
  [[nodiscard]] const View* find_earlier(const Track& track, int gap, std::size_t end) const;
  [[nodiscard]] std::optional<Pair> compare(const View& earlier, std::size_t instance) const;
  // What a similarity must not fall below.
  [[nodiscard]] double threshold_of(std::size_t instance) const;
  void forget_old(std::size_t now);

  ContourWindowOptions options_;
  double depth_scale_;  // of the camera
  CarriedComparison carried_;
  std::size_t window_, sparse_window_;
  RecordTable movers_;
  std::deque<View> views_;
  std::map<InstanceId, Track> tracks_;
  std::optional<std::size_t> last_frame_;
};

}  // namespace ipl_slam
