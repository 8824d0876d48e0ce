#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "common/options.hpp"
#include "geometry/camera.hpp"
#include "geometry/se3.hpp"
#include "segmentation/instance.hpp"
#include "segmentation/mask_moments.hpp"

namespace ipl_slam {

/// How masks of two frames are compared where the camera moved between them.
struct CarriedComparisonOptions {
  int samples = 1500;             ///< pixels taken of a mask at most, on a regular grid: bounds the cost
  double depth_gap = 0.1;         ///< 1/m; surfaces whose inverse depths differ by more are not the same
  bool surface_agreement = true;  ///< what lies in both masks is common only where the depth agrees
  double outline_weight = 0.25;   ///< of what only one mask holds although its surface is still in place
  double unmeasured_depth = 8.0;  ///< m, of an instance without a single depth
  double minimum_visible = 0.3;   ///< part of each mask that the other frame must have been able to show

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("samples", samples,
             {50, 1e6, "count", "pixels taken of each mask at most, on a regular grid; bounds the cost"});
    v.number("depth_gap", depth_gap,
             {1e-3, 10.0, "1/m", "difference of inverse depth from which on two surfaces are not the same"});
    v.flag("surface_agreement", surface_agreement,
           "what lies in both masks counts as common only where the depth agrees, so that coming nearer or "
           "going "
           "away is motion too");
    v.number("outline_weight", outline_weight,
             {0.0, 1.0, "1",
              "weight of what only one mask holds although its surface is still in its place: "
              "noise of the outline, or something flat that slid"});
    v.number("unmeasured_depth", unmeasured_depth,
             {0.5, 1000.0, "m", "depth of an instance of which the sensor measures none: beyond its range"});
    v.number("minimum_visible", minimum_visible,
             {0.01, 1.0, "1",
              "part of each mask that the other frame must have been able to show; else the pair "
              "tells nothing"});
  }
};

/// What one frame shows of the instances: their masks and what is needed to carry these elsewhere.
struct InstanceView {
  /// Of a mask, computed once.
  struct Shape {
    cv::Rect box;
    int area = 0;
    double inverse_depth = 0.0;  ///< median of what is measured, 1/m; 0 where nothing is
  };

  /// `depth` (CV_16UC1, raw) is shared, not copied: it must not be written to afterwards.
  InstanceView(std::vector<TrackedInstance> instances, cv::Mat depth, std::optional<SE3> T_wc,
               double depth_scale);

  std::vector<TrackedInstance> instances;
  std::vector<Shape> shapes;  ///< parallel to instances
  cv::Mat depth;
  std::optional<SE3> T_wc;  ///< camera to world; nothing where the camera is lost
  double depth_scale;

  /// Inverse depth (1/m) of what is seen at a pixel: measured, else that of the nearest instance there. 0
  /// where neither is known.
  [[nodiscard]] double inverse_depth(int x, int y) const;
  /// Whether a pixel belongs to an instance other than the i-th.
  [[nodiscard]] bool another_instance(std::size_t i, int x, int y) const;
};

/// An object's two shapes in the later view.
struct ShapeComparison {
  double iou = 0.0;
  HuInvariants earlier{}, later{};
};

/// Compares the masks of one object in two frames as if the camera had not moved: were the object still, its
/// earlier points would lie at known places of the later view and the other way round. No picture is warped:
/// pixels of each mask on a regular grid are carried into the other view, one by one, each standing for the
/// area it covers there, so there are no holes to close. What the other frame cannot show, because it lies
/// outside its image or behind something nearer, is left out of both shapes.
class CarriedComparison {
 public:
  CarriedComparison(const Camera& camera, const CarriedComparisonOptions& options);

  /// Compares instance `a` of the earlier with instance `b` of the later view (indices into their instances).
  /// Nothing where a pose is missing or too little was visible in both.
  [[nodiscard]] std::optional<ShapeComparison> compare(const InstanceView& earlier, std::size_t a,
                                                       const InstanceView& later, std::size_t b) const;

 private:
  struct CarriedMask;
  enum class Place { own, carried };
  // Carries mask `i` of a view into another, where the same object has mask `j`; its shape is described where
  // it lies or where it is carried to, about `origin`.
  [[nodiscard]] CarriedMask carry(const InstanceView& from, std::size_t i, const InstanceView& to,
                                  std::size_t j, Place described, cv::Point origin) const;

  Camera camera_;
  CarriedComparisonOptions options_;
  std::vector<Eigen::Vector2f> rays_;  // x/z, y/z of each pixel, row by row
};

}  // namespace ipl_slam
