#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "common/ids.hpp"
#include "common/options.hpp"
#include "dense/dense_view.hpp"
#include "dense/label_voters.hpp"
#include "dense/semantic_cloud.hpp"
#include "dense/surface_extractor.hpp"
#include "geometry/camera.hpp"
#include "geometry/se3.hpp"

namespace ipl_slam {

/// How points get colours and classes.
struct PaintOptions {
  double tolerance = 0.02;          ///< m
  double depth_tolerance = 0.0042;  ///< 1/m; three times VolumeOptions::depth_sigma
  int margin = 3;                   ///< pixels
  double depth_spread = 0.3;        ///< m
  int min_views = 2;                ///< that name a class
  double min_share = 0.4;           ///< of the evidence
  double background_weight = 0.15;  ///< of a view that names nothing
  double same_object = 0.3;         ///< share of the smaller set of points
  int min_object = 50;              ///< points

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("tolerance", tolerance,
             {0.0, 1.0, "m", "a point is seen if the depth measured there is off by less than this"});
    v.number("depth_tolerance", depth_tolerance,
             {0.0, 1.0, "1/m",
              "or, far away, by less than this x depth^2: three standard deviations of a structured-light "
              "camera"});
    v.number("margin", margin,
             {0, 50, "px",
              "pixels this near to another instance's do not vote on classes; in images 640 wide, in scale "
              "in others"});
    v.number("depth_spread", depth_spread,
             {0.0, 100.0, "m",
              "nor do pixels further behind their instance's median depth than this, or than three times its "
              "median deviation: masks hold what is seen through or beside the thing"});
    v.number("min_views", min_views,
             {1, 1000, "count", "views that must name a point's class, or an object's"});
    v.number("min_share", min_share,
             {0.0, 1.0, "", "least share of its class among what views say of a point"});
    v.number(
        "background_weight", background_weight,
        {0.0, 1.0, "",
         "what a view that sees a point and names nothing there counts against one that names something: "
         "small, as segmenters miss more than they invent"});
    v.number("same_object", same_object,
             {0.0, 1.0, "",
              "tracks of one class are one object if they share more than this part of the smaller one's "
              "points"});
    v.number("min_object", min_object, {1, 1000000, "count", "objects have at least as many points"});
  }
};

/// A view that paints. The images are of the camera's size and undistorted.
struct PaintView {
  const cv::Mat& color;                        ///< CV_8UC3, BGR
  const cv::Mat& depth;                        ///< CV_32FC1, m, as RangeImage::depth: 0 = not to be used
  const cv::Mat& labels;                       ///< CV_8UC1: 0 = nobody, k = instances[k - 1]; may be empty
  const std::vector<ViewInstance>& instances;  ///< 255 at most
};

/// Gives surface points the colours of the views that see them, and the classes of what stands there. All
/// sums are of whole numbers: the order of views does not matter to colours, classes and confidences.
class CloudPainter {
 public:
  /// points: as extract_surface() orders them. camera: its distortion does not count.
  CloudPainter(std::vector<SurfacePoint> points, const Camera& camera, const PaintOptions& options);

  /// Throws std::invalid_argument for images of the wrong size or type.
  void add(const PaintView& view, const SE3& T_cw);

  /// The points that a view saw, in the order they were given. The confidence of a label is the mean of the
  /// scores its class has at the point: 0 in views that name something else, and in those that name nothing,
  /// which count background_weight.
  [[nodiscard]] SemanticCloud cloud() const;
  /// What stands there, by label, then by size. Tracks of one class that lie on each other are one object.
  [[nodiscard]] std::vector<CloudObject> objects() const;

 private:
  /// Successive points of one block.
  struct Group {
    std::uint32_t first, last;  // points [first, last)
    Eigen::Vector3f centre;     // of a ball that holds them, world
    float radius;
  };
  /// Colours of a point.
  struct Paint {
    std::uint32_t weight = 0;
    std::array<std::uint32_t, 3> sum{};  // weight x blue, green, red
  };
  /// What a track says of a point; a list per point.
  struct Vote {
    std::uint32_t next;   // in votes_, or kNone
    std::uint32_t track;  // in tracks_
    std::uint32_t score;  // sum, in 1/kScoreSteps
    std::uint32_t views;
  };
  /// An instance as one class. (A tracker may change its mind about the class.)
  struct Track {
    std::int32_t label;
    std::vector<std::uint32_t> views;  // in which it voted
  };
  struct Verdict {
    std::int32_t label = CloudPoint::kUnlabelled;
    float confidence = 0.0F;
  };
  /// What an instance of a view votes for.
  struct Name {
    std::uint32_t track;  // in tracks_; kNone = "unknown", which is no name
    std::uint32_t score;  // in 1/kScoreSteps
  };
  struct Sight;
  class Projection;
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  [[nodiscard]] std::vector<Name> names_in(const PaintView& view);
  void paint(std::uint32_t point, const cv::Vec3b& bgr, const Sight& sight);
  void vote(std::uint32_t point, const Name& name);
  [[nodiscard]] Verdict verdict(std::uint32_t point) const;
  [[nodiscard]] bool seen(std::uint32_t point) const { return paints_[point].weight > 0; }
  [[nodiscard]] std::vector<std::uint32_t> joined_tracks() const;
  [[nodiscard]] std::uint32_t object_of(std::uint32_t point, std::int32_t label,
                                        const std::vector<std::uint32_t>& joined) const;

  std::vector<SurfacePoint> points_;
  Camera camera_;
  PaintOptions options_;
  ClassLabels labels_;
  std::vector<Group> groups_;
  std::vector<Paint> paints_;            // per point
  std::vector<std::uint32_t> votes_of_;  // per point: the first in votes_, or kNone
  std::vector<std::uint32_t> unnamed_;   // per point: views that name nothing there
  std::vector<Vote> votes_;
  std::map<std::pair<InstanceId, std::int32_t>, std::uint32_t> track_numbers_;  // by id and label
  std::vector<Track> tracks_;
  std::uint32_t views_ = 0;
};

}  // namespace ipl_slam
