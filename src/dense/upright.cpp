#include "dense/upright.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>

namespace ipl_slam {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kLevelStep = 0.02;  // m, of the histogram of heights
constexpr int kLevelReach = 2;       // steps to either side that belong to one level: noise of depth at 3 m
constexpr double kUnderFloor = 0.1;  // m; what lies lower than this under a level is under it
constexpr double kFewUnderFloor = 0.02;  // share of all points: specks, and reflections in polished floors
constexpr double kFarOut = 0.001;        // share of the points at either end that may be anywhere
constexpr int kMostLevels = 100000;      // 2 km of height

// Cameras that look in all directions have no mean up; this is that of two, 120 degrees apart.
constexpr double kLeastAgreement = 0.5;

Eigen::Vector3d mean_up(const Trajectory& trajectory, const Eigen::Vector3d& guess) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const StampedPose& pose : trajectory) sum -= pose.T_wc.rotation_matrix().col(1);
  const bool agree = sum.norm() > kLeastAgreement * static_cast<double>(trajectory.size());
  return agree ? sum.normalized() : guess.normalized();
}

// Any two directions that are at right angles to a third and each other.
struct Plane {
  explicit Plane(const Eigen::Vector3d& normal) : a(normal.unitOrthogonal()), b(normal.cross(a)) {}
  Eigen::Vector3d a, b;
};

// Directions near `about`, counted by where they point to (gnomonic projection), one cell a degree.
class DirectionHistogram {
 public:
  DirectionHistogram(const Eigen::Vector3d& about, double reach)
      : about_(about), plane_(about), half_(static_cast<int>(std::ceil(std::tan(reach) / kDegree)) + kBlur) {
    cells_.resize(static_cast<std::size_t>(side()) * side());
  }

  void add(const Eigen::Vector3d& direction) {
    const double depth = direction.dot(about_);
    ++cells_[index(cell(direction.dot(plane_.a) / depth), cell(direction.dot(plane_.b) / depth))];
  }

  // The middle of the cells that hold most, a few to either side counted in.
  [[nodiscard]] Eigen::Vector3d peak() const {
    int best_x = 0, best_y = 0, most = -1;
    for (int y = kBlur - half_; y <= half_ - kBlur; ++y) {
      for (int x = kBlur - half_; x <= half_ - kBlur; ++x) {
        const int count = around(x, y);
        if (count > most) most = count, best_x = x, best_y = y;
      }
    }
    return (about_ + kDegree * (best_x * plane_.a + best_y * plane_.b)).normalized();
  }

 private:
  static constexpr int kBlur = 2;

  [[nodiscard]] int side() const { return 2 * half_ + 1; }
  [[nodiscard]] int cell(double slope) const {
    return std::clamp(static_cast<int>(std::lround(slope / kDegree)), -half_, half_);
  }
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y + half_) * side() + (x + half_);
  }
  [[nodiscard]] int around(int x, int y) const {
    int count = 0;
    for (int dy = -kBlur; dy <= kBlur; ++dy) {
      for (int dx = -kBlur; dx <= kBlur; ++dx) count += cells_[index(x + dx, y + dy)];
    }
    return count;
  }

  Eigen::Vector3d about_;
  Plane plane_;
  int half_;
  std::vector<int> cells_;
};

struct Directions {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  std::size_t count = 0;
};

Directions near(const std::vector<Eigen::Vector3d>& normals, const Eigen::Vector3d& direction, double reach) {
  Directions result;
  for (const Eigen::Vector3d& n : normals) {
    if (n.dot(direction) < std::cos(reach)) continue;
    result.mean += n;
    ++result.count;
  }
  if (result.count > 0) result.mean.normalize();
  return result;
}

// The direction near a guess that most normals share (mean shift from the fullest cell).
Directions shared_direction(const std::vector<Eigen::Vector3d>& normals, const Eigen::Vector3d& guess,
                            const UprightOptions& options) {
  constexpr int kIterations = 10;
  const double reach = options.max_tilt * kDegree;
  DirectionHistogram histogram(guess, reach);
  for (const Eigen::Vector3d& n : normals) {
    if (n.dot(guess) >= std::cos(reach)) histogram.add(n);
  }
  Directions found{histogram.peak(), 0};
  for (int i = 0; i < kIterations; ++i) {
    const Directions next = near(normals, found.mean, options.same_direction * kDegree);
    if (next.count == 0) return {guess, 0};
    found = next;
  }
  return found;
}

bool is_enough(std::size_t count, std::size_t of, double share) {
  constexpr std::size_t kLeast = 50;
  return count >= kLeast && static_cast<double>(count) >= share * static_cast<double>(of);
}

double quantile(std::vector<double> values, double share) {
  const auto place = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[static_cast<std::size_t>(place)];
}

// The lowest level that many of the level points have, under which hardly any of all points lies.
std::optional<double> floor_of(const std::vector<double>& level_points, std::vector<double> all,
                               double floor_share) {
  if (level_points.empty()) return std::nullopt;
  std::sort(all.begin(), all.end());
  const auto out = static_cast<std::size_t>(kFarOut * static_cast<double>(all.size()));
  const double low = all[out] - kLevelReach * kLevelStep, high = all[all.size() - 1 - out];
  const int levels = static_cast<int>(std::min<double>((high - low) / kLevelStep, kMostLevels)) + 1;
  std::vector<int> counts(static_cast<std::size_t>(levels));
  for (const double z : level_points) {
    const double level = std::floor((z - low) / kLevelStep);
    if (level >= 0.0 && level < levels) ++counts[static_cast<std::size_t>(level)];
  }
  const auto around = [&](int level) {
    int sum = 0;
    for (int k = std::max(level - kLevelReach, 0); k <= std::min(level + kLevelReach, levels - 1); ++k) {
      sum += counts[static_cast<std::size_t>(k)];
    }
    return sum;
  };
  int most = 0;
  for (int level = 0; level < levels; ++level) most = std::max(most, around(level));
  int lowest = 0;
  while (lowest < levels - 1 && (around(lowest) == 0 || around(lowest) < floor_share * most ||
                                 around(lowest + 1) > around(lowest))) {
    ++lowest;
  }
  const double middle = low + (lowest + 0.5) * kLevelStep, reach = (kLevelReach + 0.5) * kLevelStep;
  std::vector<double> same;
  for (const double z : level_points) {
    if (std::abs(z - middle) <= reach) same.push_back(z);
  }
  if (same.empty()) return std::nullopt;
  const double height = quantile(same, 0.5);
  const auto under = std::lower_bound(all.begin(), all.end(), height - kUnderFloor) - all.begin();
  if (static_cast<double>(under) > kFewUnderFloor * static_cast<double>(all.size())) return std::nullopt;
  return height;
}

// Where walls face, as the angle from `plane.a`, up to quarter turns.
std::optional<double> wall_angle(const std::vector<Eigen::Vector3d>& normals, const Eigen::Vector3d& up,
                                 const Plane& plane, const UprightOptions& options) {
  constexpr int kCells = 90;
  constexpr double kQuarter = std::numbers::pi / 2.0;
  const double flat = std::sin(2.0 * options.same_direction * kDegree);
  std::vector<double> angles;
  std::vector<int> cells(kCells);
  for (const Eigen::Vector3d& n : normals) {
    if (std::abs(n.dot(up)) > flat) continue;
    const double angle = std::atan2(n.dot(plane.b), n.dot(plane.a));
    const double in_quarter = angle - kQuarter * std::floor(angle / kQuarter);
    angles.push_back(in_quarter);
    ++cells[static_cast<std::size_t>(in_quarter / kDegree) % kCells];
  }
  int best = 0, most = -1;
  for (int i = 0; i < kCells; ++i) {
    int count = 0;
    for (int k = -2; k <= 2; ++k) count += cells[static_cast<std::size_t>(i + k + kCells) % kCells];
    if (count > most) most = count, best = i;
  }
  const double coarse = (best + 0.5) * kDegree;
  double sum = 0.0;
  std::size_t count = 0;
  for (const double angle : angles) {
    const double difference = std::remainder(angle - coarse, kQuarter);
    if (std::abs(difference) > options.same_direction * kDegree) continue;
    sum += difference;
    ++count;
  }
  if (!is_enough(count, normals.size(), options.min_share)) return std::nullopt;
  // Without walls the angles are spread evenly and any of them would be a peak.
  const double evenly = 2.0 * options.same_direction / 90.0 * static_cast<double>(angles.size());
  if (static_cast<double>(count) < 2.0 * evenly) return std::nullopt;
  return coarse + sum / static_cast<double>(count);
}

// Of four directions a quarter turn apart, the one nearest to `ahead`.
Eigen::Vector3d along_walls(const Plane& plane, double angle, const Eigen::Vector3d& ahead) {
  const Eigen::Vector3d first = std::cos(angle) * plane.a + std::sin(angle) * plane.b;
  const Eigen::Vector3d second = std::cos(angle) * plane.b - std::sin(angle) * plane.a;
  const double along = first.dot(ahead), across = second.dot(ahead);
  if (std::abs(along) >= std::abs(across)) return along >= 0.0 ? first : -first;
  return across >= 0.0 ? second : -second;
}

}  // namespace

Upright upright_frame(const SemanticCloud& cloud, const Trajectory& trajectory, const UprightOptions& options,
                      const Eigen::Vector3d& guess, const Eigen::Vector3d& ahead) {
  std::vector<Eigen::Vector3d> normals;
  for (const CloudPoint& point : cloud.points) {
    if (!point.normal.isZero()) normals.push_back(point.normal.cast<double>());
  }
  Upright result;
  Eigen::Vector3d up = mean_up(trajectory, guess);
  const Directions level = shared_direction(normals, up, options);
  result.level_was_found = is_enough(level.count, normals.size(), options.min_share);
  if (result.level_was_found) up = level.mean;

  const Plane plane(up);
  Eigen::Vector3d first_ahead = trajectory.empty() ? ahead : trajectory.front().T_wc.rotation_matrix().col(2);
  first_ahead -= up * up.dot(first_ahead);
  // A camera that looks straight up or down has its upper edge ahead, or its lower one.
  constexpr double kStraight = 1e-3;
  const bool is_steep = first_ahead.norm() < kStraight;
  Eigen::Vector3d x = is_steep ? plane.a : Eigen::Vector3d(first_ahead.normalized());
  if (const auto angle = wall_angle(normals, up, plane, options)) {
    x = along_walls(plane, *angle, x);
    result.walls_were_found = true;
  }
  Eigen::Matrix3d R_uw;
  R_uw << x.transpose(), up.cross(x).transpose(), up.transpose();

  std::vector<double> heights, level_heights;
  for (const CloudPoint& point : cloud.points) {
    heights.push_back(up.dot(point.position.cast<double>()));
    const bool is_level =
        point.normal.cast<double>().dot(up) > std::cos(2.0 * options.same_direction * kDegree);
    if (is_level) level_heights.push_back(heights.back());
  }
  double floor = 0.0;
  if (!heights.empty()) {
    const auto found =
        result.level_was_found ? floor_of(level_heights, heights, options.floor_share) : std::nullopt;
    result.floor_was_found = found.has_value();
    floor = found.value_or(quantile(heights, kFarOut));
  }
  result.T_uw = SE3(R_uw, Eigen::Vector3d(0.0, 0.0, -floor));
  return result;
}

}  // namespace ipl_slam
