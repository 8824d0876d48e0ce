#include "evaluation/mask_score.hpp"

#include <stdexcept>

namespace ipl_slam {

namespace {

double share(std::int64_t part, std::int64_t whole, double of_nothing) {
  return whole == 0 ? of_nothing : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

void MaskScore::add(const BitMask& found, const BitMask& truth) {
  if (found.size() != truth.size()) {
    throw std::invalid_argument("MaskScore: the masks differ in size");
  }
  const int common = intersection_area(found, truth);
  hits += common;
  misses += truth.area() - common;
  false_alarms += found.area() - common;
  pixels += found.size().area();
}

MaskScore& MaskScore::operator+=(const MaskScore& other) {
  hits += other.hits;
  misses += other.misses;
  false_alarms += other.false_alarms;
  pixels += other.pixels;
  return *this;
}

double MaskScore::recall() const {
  return share(hits, hits + misses, 1.0);
}
double MaskScore::precision() const {
  return share(hits, hits + false_alarms, 1.0);
}
double MaskScore::false_area() const {
  return share(false_alarms, pixels, 0.0);
}

}  // namespace ipl_slam
