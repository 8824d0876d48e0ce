#include "dense/cloud_painter.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

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

int margin_in(const Camera& camera, const PaintOptions& options) {
  constexpr double kReferenceWidth = 640.0;  // pixels, that PaintOptions::margin speaks of
  return static_cast<int>(std::lround(options.margin * camera.width / kReferenceWidth));
}

}  // namespace

// A point as a view sees it.
struct CloudPainter::Sight {
  int u, v;      // its pixel
  float depth;   // measured there, m
  float cosine;  // between ray and normal
};

// What of the world lies in a view.
class CloudPainter::Projection {
 public:
  Projection(const Camera& camera, const SE3& T_cw, const cv::Mat& depth, const PaintOptions& options)
      : R_cw_(T_cw.rotation_matrix().cast<float>()),
        t_cw_(T_cw.translation().cast<float>()),
        centre_w_(T_cw.inverse().translation().cast<float>()),
        fx_(static_cast<float>(camera.fx)),
        fy_(static_cast<float>(camera.fy)),
        left_(static_cast<float>(camera.cx) + 0.5F),
        top_(static_cast<float>(camera.cy) + 0.5F),
        width_(static_cast<float>(camera.width)),
        height_(static_cast<float>(camera.height)),
        sides_{Eigen::Vector3f(fx_, 0, left_).normalized(),
               Eigen::Vector3f(-fx_, 0, width_ - left_).normalized(),
               Eigen::Vector3f(0, fy_, top_).normalized(),
               Eigen::Vector3f(0, -fy_, height_ - top_).normalized()},
        depth_(depth),
        tolerance_(static_cast<float>(options.tolerance)),
        depth_tolerance_(static_cast<float>(options.depth_tolerance)) {
    double most = 0.0;
    cv::minMaxLoc(depth, nullptr, &most);
    farthest_ = static_cast<float>(most) + tolerance(static_cast<float>(most));
  }

  [[nodiscard]] bool may_see(const Group& group) const {
    const Eigen::Vector3f c = R_cw_ * group.centre + t_cw_;
    if (c.z() < -group.radius || c.z() - group.radius > farthest_) return false;
    return std::all_of(sides_.begin(), sides_.end(),
                       [&](const Eigen::Vector3f& side) { return side.dot(c) >= -group.radius; });
  }

  // False where the point is out of the picture, turned away, or not what the depth shows.
  [[nodiscard]] bool see(const SurfacePoint& point, Sight& sight) const {
    const Eigen::Vector3f towards = centre_w_ - point.position;
    const float facing = point.normal.dot(towards);
    if (facing <= 0.0F) return false;
    const Eigen::Vector3f p_c = R_cw_ * point.position + t_cw_;
    if (p_c.z() <= 0.0F) return false;
    const float u = fx_ * p_c.x() / p_c.z() + left_, v = fy_ * p_c.y() / p_c.z() + top_;
    if (!(u >= 0.0F && v >= 0.0F && u < width_ && v < height_)) return false;
    sight.u = static_cast<int>(u);
    sight.v = static_cast<int>(v);
    sight.depth = depth_.at<float>(sight.v, sight.u);
    if (sight.depth <= 0.0F || std::abs(p_c.z() - sight.depth) > tolerance(sight.depth)) return false;
    sight.cosine = facing / towards.norm();
    return true;
  }

 private:
  [[nodiscard]] float tolerance(float depth) const {
    return std::max(tolerance_, depth_tolerance_ * depth * depth);
  }

  Eigen::Matrix3f R_cw_;
  Eigen::Vector3f t_cw_, centre_w_;
  float fx_, fy_;
  float left_, top_;  // from the picture's edges to the principal point
  float width_, height_;
  std::array<Eigen::Vector3f, 4> sides_;  // of the pyramid of sight: unit normals, inwards, camera frame
  const cv::Mat& depth_;
  float tolerance_, depth_tolerance_;
  float farthest_ = 0.0F;  // depth of what can be seen
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
  const Projection projection(camera_, T_cw, view.depth, options_);
  const LabelVoters voters(view.instances.empty() ? cv::Mat() : view.labels, view.depth,
                           margin_in(camera_, options_), options_.depth_spread);
  const std::vector<Name> names = names_in(view);
  Sight sight{};
  for (const Group& group : groups_) {
    if (!projection.may_see(group)) continue;
    for (std::uint32_t i = group.first; i < group.last; ++i) {
      if (!projection.see(points_[i], sight)) continue;
      paint(i, view.color.at<cv::Vec3b>(sight.v, sight.u), sight);
      const LabelVoters::Says says = voters.says(sight.u, sight.v, sight.depth);
      if (says == LabelVoters::Says::kNothing) continue;
      const Name* name =
          says == LabelVoters::Says::kInstance ? &names[voters.label(sight.u, sight.v) - 1U] : nullptr;
      if (name != nullptr && name->track != kNone) {
        vote(i, *name);
      } else {
        ++unnamed_[i];
      }
    }
  }
  ++views_;
}

std::vector<CloudPainter::Name> CloudPainter::names_in(const PaintView& view) {
  std::vector<Name> names;
  for (const ViewInstance& instance : view.instances) {
    if (instance.class_name == "unknown") {
      names.push_back({kNone, 0});
      continue;
    }
    const std::int32_t label = labels_.label(instance.class_name);
    const auto [it, is_new] =
        track_numbers_.try_emplace({instance.id, label}, static_cast<std::uint32_t>(tracks_.size()));
    if (is_new) tracks_.push_back({label, {}});
    names.push_back({it->second, static_cast<std::uint32_t>(std::lround(kScoreSteps * instance.score))});
  }
  return names;
}

void CloudPainter::paint(std::uint32_t point, const cv::Vec3b& bgr, const Sight& sight) {
  const float ratio = sight.cosine / sight.depth;
  const auto weight = static_cast<std::uint32_t>(std::clamp(kUnitWeight * ratio * ratio, 1.0F, kMostWeight));
  Paint& paint = paints_[point];
  paint.weight += weight;
  for (int c = 0; c < 3; ++c) paint.sum[static_cast<std::size_t>(c)] += weight * bgr[c];
}

void CloudPainter::vote(std::uint32_t point, const Name& name) {
  std::vector<std::uint32_t>& views = tracks_[name.track].views;
  if (views.empty() || views.back() != views_) views.push_back(views_);
  std::uint32_t at = votes_of_[point];
  while (at != kNone && votes_[at].track != name.track) at = votes_[at].next;
  if (at == kNone) {
    at = static_cast<std::uint32_t>(votes_.size());
    votes_.push_back({votes_of_[point], name.track, 0, 0});
    votes_of_[point] = at;
  }
  votes_[at].score += name.score;
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
