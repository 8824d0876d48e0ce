#include "segmentation/class_role.hpp"

#include <algorithm>
#include <array>

namespace ipl_slam {
namespace {

constexpr std::array<std::string_view, 19> kLikelyMovers = {
    "person", "bicycle", "car",   "motorcycle", "airplane", "bus",      "train", "truck", "boat",   "bird",
    "cat",    "dog",     "horse", "sheep",      "cow",      "elephant", "bear",  "zebra", "giraffe"};

// COCO's classes that neither move by themselves nor are carried about in use. Its remaining classes (bags,
// toys, dishes, food, chairs, electronics, books, ...) are movable.
constexpr std::array<std::string_view, 14> kBackground = {
    "traffic light", "fire hydrant", "stop sign", "parking meter", "bench", "couch",        "bed",
    "dining table",  "toilet",       "tv",        "microwave",     "oven",  "refrigerator", "sink"};

template <std::size_t N>
bool contains(const std::array<std::string_view, N>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

ClassRole class_role(std::string_view class_name) {
  if (contains(kLikelyMovers, class_name)) return ClassRole::likely_mover;
  return contains(kBackground, class_name) ? ClassRole::background : ClassRole::movable;
}

}  // namespace ipl_slam
