#include <cmath>
#include <numbers>
#include <random>

#include "features/brief.hpp"
#include "features/orientation.hpp"

namespace ipl_slam {
namespace {

std::array<BriefTest, 256> make_pattern() {
  std::mt19937 random(1);
  auto uniform = [&random] { return (static_cast<double>(random()) + 0.5) / 4294967296.0; };
  auto point = [&uniform](std::int8_t& x, std::int8_t& y) {
    while (true) {
      const double r = 6.2 * std::sqrt(-2.0 * std::log(uniform()));
      const double a = 2.0 * std::numbers::pi * uniform();
      const double px = std::round(r * std::cos(a));
      const double py = std::round(r * std::sin(a));
      if (px * px + py * py > kPatchRadius * kPatchRadius) continue;
      x = static_cast<std::int8_t>(px);
      y = static_cast<std::int8_t>(py);
      return;
    }
  };
  std::array<BriefTest, 256> tests{};
  for (BriefTest& t : tests) {
    do {
      point(t.x1, t.y1);
      point(t.x2, t.y2);
    } while (t.x1 == t.x2 && t.y1 == t.y2);
  }
  return tests;
}

}  // namespace

const std::array<BriefTest, 256>& brief_pattern() {
  static const std::array<BriefTest, 256> pattern = make_pattern();
  return pattern;
}

}  // namespace ipl_slam
