#include "dense/cloud_painter.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "common/union_find.hpp"

namespace ipl_slam {
namespace {

constexpr double kScoreSteps = 256.0;
// A view's weight for colours is (cosine of incidence / depth)^2 x kUnitWeight, 1 to kMostWeight: near
// frontal views show most detail. Sums then hold more than 65000 views.
constexpr float kUnitWeight = 64.0F;
constexpr float kMostWeight = 255.0F;
// An object's box holds all but this share of its points at either end of each axis: single points are
// strays.
constexpr double kBoxTail = 0.02;

void check(const PaintView& view, const cv::Size& size) {
  const bool fits = view.color.type() == CV_8UC3 && view.color.size() == size &&
                    view.depth.type() == CV_32FC1 && view.depth.size() == size &&
                    (view.labels.empty() || (view.labels.type() == CV_8UC1 && view.labels.size() == size));
  if (!fits) throw std::invalid_argument("CloudPainter: images do not fit the camera");
}

float quantile(std::vector<float>& values, double share) {
  const auto at = values.begin() + std::lround(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

// Where points of the world come to lie in a view.
struct CloudPainter::Projection {
  Eigen::Matrix3f R_cw;
  Eigen::Vector3f t_cw, camera_w;
  float fx, fy, cx, cy;
  int width, height;
  std::array<Eigen::Vector3f, 4> sides;  // of the pyramid of sight: unit normals, inwards, camera frame
  float farthest;                        // depth at which something was measured

  Projection(const Camera& camera, const SE3& T_cw, const cv::Mat& depth)
      : R_cw(T_cw.rotation_matrix().cast<float>()),
        t_cw(T_cw.translation().cast<float>()),
        camera_w(T_cw.inverse().translation().cast<float>()),
        fx(static_cast<float>(camera.fx)),
        fy(static_cast<float>(camera.fy)),
        cx(static_cast<float>(camera.cx)),
        cy(static_cast<float>(camera.cy)),
        width(camera.width),
        height(camera.height) {
    const float left = cx + 0.5F, top = cy + 0.5F;  // from the principal point to the picture's edges
    const float right = static_cast<float>(width) - left, bottom = static_cast<float>(height) - top;
    sides = {Eigen::Vector3f(fx, 0, left).normalized(), Eigen::Vector3f(-fx, 0, right).normalized(),
             Eigen::Vector3f(0, fy, top).normalized(), Eigen::Vector3f(0, -fy, bottom).normalized()};
    double most = 0.0;
    cv::minMaxLoc(depth, nullptr, &most);
    farthest = static_cast<float>(most);
  }

  [[nodiscard]] bool may_see(const Group& group, float tolerance) const {
    const Eigen::Vector3f c = R_cw * group.centre + t_cw;
    if (c.z() < -group.radius || c.z() - group.radius > farthest + tolerance) return false;
    return std::all_of(sides.begin(), sides.end(),
                       [&](const Eigen::Vector3f& side) { return side.dot(c) >= -group.radius; });
  }
};

CloudPainter::CloudPainter(std::vector<SurfacePoint> points, const Camera& camera,
                           const PaintOptions& options)
    : points_(std::move(points)),
      camera_(camera),
      options_(options),
      paints_(points_.size()),
      votes_of_(points_.size(), kNone),
      unnamed_(points_.size(), 0) {
  const auto count = static_cast<std::uint32_t>(points_.size());
  for (std::uint32_t first = 0, last = 0; first < count; first = last) {
    const BlockCoord place = VoxelGrid::block_of(points_[first].voxel);
    Eigen::Vector3f low = points_[first].position, high = low;
    for (; last < count && VoxelGrid::block_of(points_[last].voxel) == place; ++last) {
      low = low.cwiseMin(points_[last].position);
      high = high.cwiseMax(points_[last].position);
    }
    groups_.push_back({first, last, 0.5F * (low + high), 0.5F * (high - low).norm()});
  }
}

void CloudPainter::add(const PaintView& view, const SE3& T_cw) {
  check(view, {camera_.width, camera_.height});
  const Projection projection(camera_, T_cw, view.depth);
  const std::vector<std::uint32_t> tracks = tracks_of(view);
  const LabelVoters voters(view.instances.empty() ? cv::Mat() : view.labels, view.depth, options_.margin,
                           options_.depth_spread);
  const auto tolerance = static_cast<float>(options_.tolerance);
  const auto depth_tolerance = static_cast<float>(options_.depth_tolerance);
  const float group_tolerance =
      std::max(tolerance, depth_tolerance * projection.farthest * projection.farthest);
  for (const Group& group : groups_) {
    if (!projection.may_see(group, group_tolerance)) continue;
    for (std::uint32_t i = group.first; i < group.last; ++i) {
      const SurfacePoint& point = points_[i];
      const Eigen::Vector3f towards = projection.camera_w - point.position;
      const float facing = point.normal.dot(towards);
      if (facing <= 0.0F) continue;
      const Eigen::Vector3f p_c = projection.R_cw * point.position + projection.t_cw;
      if (p_c.z() <= 0.0F) continue;
      const float u = projection.fx * p_c.x() / p_c.z() + projection.cx + 0.5F;
      const float v = projection.fy * p_c.y() / p_c.z() + projection.cy + 0.5F;
      if (!(u >= 0.0F && v >= 0.0F && u < static_cast<float>(projection.width) &&
            v < static_cast<float>(projection.height))) {
        continue;
      }
      const int x = static_cast<int>(u), y = static_cast<int>(v);
      const float depth = view.depth.at<float>(y, x);
      if (depth <= 0.0F || std::abs(p_c.z() - depth) > std::max(tolerance, depth_tolerance * depth * depth)) {
        continue;
      }
      paint(i, view.color.at<cv::Vec3b>(y, x), facing / towards.norm(), p_c.z());
      if (!view.segmented) continue;
      const LabelVoters::Says says = voters.says(x, y, depth);
      if (says == LabelVoters::Says::kNobody) ++unnamed_[i];
      if (says != LabelVoters::Says::kInstance) continue;
      const std::size_t k = voters.label(x, y) - 1U;
      vote(i, tracks[k], static_cast<std::uint32_t>(std::lround(kScoreSteps * view.instances[k].score)));
    }
  }
  ++views_;
}

std::vector<std::uint32_t> CloudPainter::tracks_of(const PaintView& view) {
  std::vector<std::uint32_t> numbers;
  for (const ViewInstance& instance : view.instances) {
    const std::int32_t label = labels_.label(instance.class_name);
    const auto [it, is_new] =
        track_numbers_.try_emplace({instance.id, label}, static_cast<std::uint32_t>(tracks_.size()));
    if (is_new) tracks_.push_back({label, {}});
    numbers.push_back(it->second);
  }
  return numbers;
}

void CloudPainter::paint(std::uint32_t point, const cv::Vec3b& bgr, float cosine, float z) {
  const float ratio = cosine / z;
  const auto weight = static_cast<std::uint32_t>(std::clamp(kUnitWeight * ratio * ratio, 1.0F, kMostWeight));
  Paint& paint = paints_[point];
  paint.weight += weight;
  for (int c = 0; c < 3; ++c) paint.sum[static_cast<std::size_t>(c)] += weight * bgr[c];
}

void CloudPainter::vote(std::uint32_t point, std::uint32_t track, std::uint32_t score) {
  std::vector<std::uint32_t>& views = tracks_[track].views;
  if (views.empty() || views.back() != views_) views.push_back(views_);
  std::uint32_t at = votes_of_[point];
  while (at != kNone && votes_[at].track != track) at = votes_[at].next;
  if (at == kNone) {
    at = static_cast<std::uint32_t>(votes_.size());
    votes_.push_back({votes_of_[point], track, 0, 0});
    votes_of_[point] = at;
  }
  votes_[at].score += score;
  ++votes_[at].views;
}

CloudPainter::Verdict CloudPainter::verdict(std::uint32_t point) const {
  struct Sum {
    std::uint32_t score = 0, views = 0;
  };
  std::map<std::int32_t, Sum> sums;  // by label
  Sum all;
  for (std::uint32_t at = votes_of_[point]; at != kNone; at = votes_[at].next) {
    const Vote& vote = votes_[at];
    Sum& sum = sums[tracks_[vote.track].label];
    sum.score += vote.score;
    sum.views += vote.views;
    all.score += vote.score;
    all.views += vote.views;
  }
  const auto best = std::max_element(
      sums.begin(), sums.end(), [](const auto& a, const auto& b) { return a.second.score < b.second.score; });
  if (best == sums.end() || static_cast<int>(best->second.views) < options_.min_views) return {};
  const double score = best->second.score / kScoreSteps;
  const double against = options_.background_weight * unnamed_[point];
  if (score < options_.min_share * (all.score / kScoreSteps + against)) return {};
  return {best->first, static_cast<float>(std::min(1.0, score / (all.views + against)))};
}

SemanticCloud CloudPainter::cloud() const {
  SemanticCloud cloud;
  std::set<std::int32_t> labels;
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    if (!seen(i)) continue;
    const auto& [weight, sum] = paints_[i];
    const auto mean = [&](std::size_t c) {
      return static_cast<std::uint8_t>((std::uint64_t{2} * sum[c] + weight) / (std::uint64_t{2} * weight));
    };
    const Verdict is = verdict(i);
    if (is.label != CloudPoint::kUnlabelled) labels.insert(is.label);
    cloud.points.push_back(
        {points_[i].position, points_[i].normal, {mean(2), mean(1), mean(0)}, is.label, is.confidence});
  }
  for (const std::int32_t label : labels) {
    cloud.classes.push_back({label, labels_.name(label), class_color(label)});
  }
  return cloud;
}

// Per track the least track of the same object.
std::vector<std::uint32_t> CloudPainter::joined_tracks() const {
  std::vector<std::uint32_t> sizes(tracks_.size(), 0);
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> shared;  // points of two tracks of a class
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    for (std::uint32_t a = votes_of_[i]; a != kNone; a = votes_[a].next) {
      ++sizes[votes_[a].track];
      for (std::uint32_t b = votes_[a].next; b != kNone; b = votes_[b].next) {
        const auto pair = std::minmax(votes_[a].track, votes_[b].track);
        if (tracks_[pair.first].label == tracks_[pair.second].label) ++shared[pair];
      }
    }
  }
  UnionFind objects(tracks_.size());
  for (const auto& [pair, points] : shared) {
    const std::uint32_t smaller = std::min(sizes[pair.first], sizes[pair.second]);
    if (points > options_.same_object * smaller) objects.join(pair.first, pair.second);
  }
  std::vector<std::uint32_t> joined(tracks_.size());
  for (std::uint32_t t = 0; t < tracks_.size(); ++t) joined[t] = objects.find(t);
  return joined;
}

// Of the objects of a class the one that the views name most at a point that has this class.
std::uint32_t CloudPainter::object_of(std::uint32_t point, std::int32_t label,
                                      const std::vector<std::uint32_t>& joined) const {
  std::map<std::uint32_t, std::uint32_t> scores;  // by object
  for (std::uint32_t at = votes_of_[point]; at != kNone; at = votes_[at].next) {
    if (tracks_[votes_[at].track].label == label) scores[joined[votes_[at].track]] += votes_[at].score;
  }
  return std::max_element(scores.begin(), scores.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

std::vector<CloudObject> CloudPainter::objects() const {
  struct Members {
    std::array<std::vector<float>, 3> coordinates;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double confidence = 0.0;
    std::set<std::uint32_t> views;
  };
  const std::vector<std::uint32_t> joined = joined_tracks();
  std::map<std::uint32_t, Members> found;  // by the object's least track
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    const Verdict is = verdict(i);
    if (is.label == CloudPoint::kUnlabelled) continue;
    Members& members = found[object_of(i, is.label, joined)];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      members.coordinates[axis].push_back(points_[i].position[static_cast<int>(axis)]);
    }
    members.sum += points_[i].position.cast<double>();
    members.confidence += is.confidence;
  }
  for (std::uint32_t t = 0; t < tracks_.size(); ++t) {
    const auto it = found.find(joined[t]);
    if (it != found.end()) it->second.views.insert(tracks_[t].views.begin(), tracks_[t].views.end());
  }

  std::vector<CloudObject> objects;
  for (auto& [track, members] : found) {
    const std::size_t count = members.coordinates[0].size();
    const auto views = static_cast<int>(members.views.size());
    if (static_cast<int>(count) < options_.min_object || views < options_.min_views) continue;
    CloudObject object;
    object.label = tracks_[track].label;
    object.class_name = labels_.name(object.label);
    object.confidence = static_cast<float>(members.confidence / static_cast<double>(count));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      object.low[static_cast<int>(axis)] = quantile(members.coordinates[axis], kBoxTail);
      object.high[static_cast<int>(axis)] = quantile(members.coordinates[axis], 1.0 - kBoxTail);
    }
    object.centre = (members.sum / static_cast<double>(count)).cast<float>();
    object.views = views;
    object.points = count;
    objects.push_back(std::move(object));
  }
  std::stable_sort(objects.begin(), objects.end(), [](const CloudObject& a, const CloudObject& b) {
    return a.label != b.label ? a.label < b.label : a.points > b.points;
  });
  return objects;
}

}  // namespace ipl_slam
