#include "dense/semantic_cloud.hpp"

#include <algorithm>
#include <cmath>

#include "segmentation/class_names.hpp"

namespace ipl_slam {
namespace {

std::int32_t place_in(const std::vector<std::string>& names, const std::string& name) {
  return static_cast<std::int32_t>(std::find(names.begin(), names.end(), name) - names.begin());
}

}  // namespace

std::int32_t ClassLabels::label(const std::string& class_name) {
  const std::vector<std::string>& coco = coco_class_names();
  const auto count = static_cast<std::int32_t>(coco.size());
  const std::int32_t known = place_in(coco, class_name);
  if (known < count) return known;
  const std::int32_t other = place_in(others_, class_name);
  if (other == static_cast<std::int32_t>(others_.size())) others_.push_back(class_name);
  return count + other;
}

std::string ClassLabels::name(std::int32_t label) const {
  const std::vector<std::string>& coco = coco_class_names();
  const auto place = static_cast<std::size_t>(label);
  return place < coco.size() ? coco[place] : others_[place - coco.size()];
}

Rgb class_color(std::int32_t label) {
  // Steps of the golden angle: hues of successive labels lie far apart. Every third is darker.
  const double hue = std::fmod(0.61803398875 * label + 0.08, 1.0) * 6.0;
  const double value = label % 3 == 2 ? 0.7 : 1.0, saturation = label % 2 == 0 ? 0.9 : 0.65;
  const auto channel = [&](double offset) {
    const double k = std::fmod(offset + hue, 6.0);
    const double v = value * (1.0 - saturation * std::clamp(std::min(k, 4.0 - k), 0.0, 1.0));
    return static_cast<std::uint8_t>(std::lround(255.0 * v));
  };
  return {channel(5.0), channel(3.0), channel(1.0)};
}

}  // namespace ipl_slam
