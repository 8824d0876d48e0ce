#pragma once

#include <set>
#include <vector>

#include <opencv2/core.hpp>

#include "common/ids.hpp"
#include "common/options.hpp"
#include "dense/dense_view.hpp"
#include "geometry/camera.hpp"

namespace ipl_slam {

/// What of a view does not enter the cloud.
struct LeftOutOptions {
  bool movers = true;      ///< what moves by itself by its class, also while it stands still
  bool moved = true;       ///< what was found to move
  int grow = 6;            ///< pixels at an image width of 640, as the next
  int reach = 72;          ///< about a forearm at 2 m; 0: limbs are not looked for
  double step = 0.015;     ///< share of the depth; two steps of a Kinect's depth at 2.5 m
  double thickness = 0.2;  ///< of a body, m
  double in_front = 0.5;   ///< share of a limb's outline

  template <class Visitor>
  void visit(Visitor& v) {
    v.flag(
        "movers", movers,
        "people, animals and vehicles are left out, also while they stand still and were not seen to move");
    v.flag("moved", moved,
           "what was found to move is left out where it did; what has no class, everywhere once it did");
    v.number(
        "grow", grow,
        {0, 200, "pixel",
         "masks of what is left out grow by this much; for images 640 pixels wide, in scale for others"});
    v.number("reach", reach,
             {0, 640, "pixel",
              "limbs that a mask lacks are looked for so far from it; 640 wide as above; 0: not at all"});
    v.number("step", step,
             {0.001, 1.0, "", "neighbours on one surface differ in depth by this share of it at most"});
    v.number(
        "thickness", thickness,
        {0.0, 10.0, "m",
         "what a mask holds by more than this behind the nearest it holds around there is background, on "
         "which no limb is looked for"});
    v.number("in_front", in_front,
             {0.0, 1.0, "",
              "a surface is a limb if more than this share of its outline stands in front of "
              "something, and is ground or wall otherwise"});
  }
};

/// moved: instances that are to be left out of the view because they moved.
[[nodiscard]] bool is_left_out(const ViewInstance& instance, const std::set<InstanceId>& moved,
                               const LeftOutOptions& options);

/// CV_8UC1, 255 where nothing of the view is to enter the cloud, 0 elsewhere. labels, depth and instances are
/// those of a DenseView, camera is its camera.
///
/// The masks of what is left out grow by a disc, and by limbs, as masks of segmenters end too early at a
/// hand, hair or a leg: surfaces that go on from somebody in the mask, within reach, without a step in depth.
/// The ground under the feet and the wall one leans on go on as well, but not with most of their outline in
/// front of something: they end where the reach does, or where somebody stands in front of them.
[[nodiscard]] cv::Mat left_out_mask(const cv::Mat& labels, const cv::Mat& depth,
                                    const std::vector<ViewInstance>& instances,
                                    const std::set<InstanceId>& moved, const Camera& camera,
                                    const LeftOutOptions& options);

}  // namespace ipl_slam
