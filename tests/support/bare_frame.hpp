#pragma once

#include <memory>

#include "common/random.hpp"
#include "support/synthetic_world.hpp"

namespace ipl_slam::test {

/// A frame with so many keypoints, on level 0, that have nothing to do with each other.
inline std::shared_ptr<const Frame> bare_frame(std::size_t keypoints) {
  Features features;
  features.keypoints.resize(keypoints);
  features.descriptors.resize(keypoints);
  Random random(keypoints);
  for (Descriptor& descriptor : features.descriptors) {
    for (auto& word : descriptor) word = random.bits();
  }
  return SyntheticWorld::make_frame(std::move(features));
}

}  // namespace ipl_slam::test
