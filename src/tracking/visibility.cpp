#include "tracking/visibility.hpp"

namespace ipl_slam {

Visibility::Visibility(const Camera& camera, const ScalePyramid& pyramid)
    : camera_(camera),
      pyramid_(pyramid),
      slack_(pyramid.levels() > 1 ? pyramid.scale(1) : 1.2),
      bounds_(camera) {}

}  // namespace ipl_slam
