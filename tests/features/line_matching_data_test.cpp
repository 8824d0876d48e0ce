// Precision and recall of line matching against known poses: a recording and rendered sequences.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "dataset/camera_config.hpp"
#include "dataset/synthetic/synthetic_source.hpp"
#include "dataset/trajectory.hpp"
#include "dataset/tum_dataset.hpp"
#include "features/line_descriptor.hpp"
#include "features/line_detector.hpp"
#include "features/line_matcher.hpp"
#include "features/line_truth.hpp"
#include "features/orb_extractor.hpp"

namespace ipl_slam {
namespace {

using testing::LineView;
using testing::MatchScore;

LineFeatures lines_of(const cv::Mat& color, const Camera& camera, LineMethod method) {
  cv::Mat grey;
  cv::cvtColor(color, grey, cv::COLOR_BGR2GRAY);
  LineFeatures lines;
  lines.segments = LineDetector(method, {}, camera).detect(grey);
  lines.descriptors = describe_segments(grey, lines.segments, {});
  return lines;
}

/// A view, its motion to another one, and that one.
struct ViewPair {
  LineView a, b;
  SE3 T_ba;
};

/// Adds the score of one pair to both kinds of matching: pose unknown, and the lines of `a` whose place in
/// space is known projected into `b` with the true motion.
struct Scores {
  MatchScore unknown_pose, projected;

  void add(const ViewPair& pair, const Camera& camera, double tolerance) {
    const LineFeatures &a = pair.a.lines, &b = pair.b.lines;
    add_score(pair.a, pair.b, camera, pair.T_ba, tolerance, match_lines(a, b, {}), unknown_pose);

    constexpr float kRadius = 10.0F;  // pixels; more than the tolerance, so that wrong ones can be chosen
    std::vector<ProjectedSegment> landmarks;
    std::vector<int> index;
    for (std::size_t i = 0; i < a.size(); ++i) {
      const auto piece = testing::carried(pair.a, camera, pair.T_ba, i);
      if (!piece) continue;
      landmarks.push_back({piece->start.cast<float>(), piece->end.cast<float>(), &a.descriptors[i], kRadius});
      index.push_back(static_cast<int>(i));
    }
    const std::vector<int> found = match_projected_lines(b, landmarks, {});
    std::vector<std::pair<int, int>> matches;
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (found[i] >= 0) matches.emplace_back(index[i], found[i]);
    }
    add_score(pair.a, pair.b, camera, pair.T_ba, tolerance, matches, projected);
  }
};

void record(const MatchScore& score, const char* kind) {
  const auto property = [&](const char* what, double value) {
    ::testing::Test::RecordProperty(std::string(kind) + "_" + what, std::to_string(value));
  };
  property("precision", score.precision());
  property("recall", score.recall());
  property("matches_judged", score.judged);
}

const char* name_of(LineMethod method) {
  return method == LineMethod::kLsd ? "lsd" : "edges";
}

class SyntheticPairs : public ::testing::TestWithParam<std::tuple<const char*, LineMethod>> {};

// Poses and depth are exact, so three pixels leave room for the detector alone.
TEST_P(SyntheticPairs, AreMatchedRightly) {
  SyntheticOptions options;
  const auto [trajectory, method] = GetParam();
  options.trajectory = trajectory;
  const SyntheticSource source(options, 2);
  const Camera camera = source.camera();
  const auto view = [&, method = method](std::size_t frame) {
    const SyntheticFrame f = source.render(frame);
    return LineView{lines_of(f.rgbd.color, camera, method), f.true_depth};
  };
  Scores scores;
  for (const std::size_t frame : {20U, 150U}) {
    const LineView first = view(frame);
    for (const std::size_t gap : {5U, 10U}) {
      const SE3 T_ba = source.T_wc(frame + gap).inverse() * source.T_wc(frame);
      scores.add({first, view(frame + gap), T_ba}, camera, 3.0);
    }
  }
  record(scores.unknown_pose, "unknown_pose"), record(scores.projected, "projected");
  EXPECT_GT(scores.unknown_pose.judged, 300);
  EXPECT_GE(scores.unknown_pose.precision(), 0.96);
  EXPECT_GE(scores.unknown_pose.recall(), 0.85);
  EXPECT_GE(scores.projected.precision(), 0.96);
  EXPECT_GE(scores.projected.recall(), 0.85);
}

INSTANTIATE_TEST_SUITE_P(Room, SyntheticPairs,
                         ::testing::Combine(::testing::Values("orbit", "xyz", "rpy"),
                                            ::testing::Values(LineMethod::kLsd, LineMethod::kEdges)),
                         [](const auto& c) {
                           return std::string(std::get<0>(c.param)) + "_" + name_of(std::get<1>(c.param));
                         });

/// Pose at a time between two stamps of motion capture, which come every 10 ms.
std::optional<SE3> pose_at(const Trajectory& truth, double time) {
  const auto after = std::lower_bound(truth.begin(), truth.end(), time,
                                      [](const StampedPose& p, double t) { return p.timestamp < t; });
  if (after == truth.begin() || after == truth.end()) return std::nullopt;
  const auto before = after - 1;
  const double between = after->timestamp - before->timestamp;
  if (between > 0.05) return std::nullopt;
  const double share = (time - before->timestamp) / between;
  return before->T_wc * SE3::exp(share * (before->T_wc.inverse() * after->T_wc).log());
}

class RecordedPairs : public ::testing::TestWithParam<LineMethod> {};

// The camera moves fast, its shutter rolls, depth is stamped some 15 ms off colour and has errors of 1 to 2
// cm (about 1 px of parallax per 10 cm of motion at 1 m): four pixels instead of three, and the motion
// refined by points.
TEST_P(RecordedPairs, AreMatchedRightly) {
  const char* data = std::getenv("IPL_SLAM_DATA");
  const auto folder = std::filesystem::path(data != nullptr ? data : "") / "fr1_desk_100";
  if (data == nullptr || !std::filesystem::is_directory(folder)) {
    GTEST_SKIP() << "needs IPL_SLAM_DATA with fr1_desk_100 in it";
  }
  constexpr std::size_t kEvery = 5;  // frames; both gaps are multiples of it
  const Camera camera = load_camera("tum1");
  TumDataset dataset(folder, camera);
  const Trajectory truth = read_trajectory(folder / "groundtruth.txt");
  OrbExtractor extractor(OrbOptions{}, camera, {});
  struct View {
    LineView lines;
    Features points;
    std::optional<SE3> T_wc;
  };
  std::vector<View> views;
  for (std::size_t i = 0; auto item = dataset.next(); ++i) {
    if (i % kEvery != 0) continue;
    ASSERT_TRUE(item->frame) << item->detail;
    View view;
    view.lines.lines = lines_of(item->frame->color, camera, GetParam());
    item->frame->depth.convertTo(view.lines.depth, CV_32F, 1.0 / camera.depth_scale);
    view.points = extractor.extract(item->frame->color, item->frame->depth);
    view.T_wc = pose_at(truth, item->timestamp);
    views.push_back(std::move(view));
  }
  Scores scores;
  for (const std::size_t gap : {1U, 2U}) {
    for (std::size_t i = 0; i + gap < views.size(); ++i) {
      const View &a = views[i], &b = views[i + gap];
      if (!a.T_wc || !b.T_wc) continue;
      const SE3 T_ba = testing::refined_motion(a.points, b.points, camera, b.T_wc->inverse() * *a.T_wc);
      scores.add({a.lines, b.lines, T_ba}, camera, 4.0);
    }
  }
  record(scores.unknown_pose, "unknown_pose"), record(scores.projected, "projected");
  EXPECT_GT(scores.unknown_pose.judged, 1000);
  EXPECT_GE(scores.unknown_pose.precision(), 0.90);
  EXPECT_GE(scores.unknown_pose.recall(), 0.70);
  EXPECT_GE(scores.projected.precision(), 0.90);
  EXPECT_GE(scores.projected.recall(), 0.75);
}

INSTANTIATE_TEST_SUITE_P(Desk, RecordedPairs, ::testing::Values(LineMethod::kLsd, LineMethod::kEdges),
                         [](const auto& method) { return name_of(method.param); });

}  // namespace
}  // namespace ipl_slam
