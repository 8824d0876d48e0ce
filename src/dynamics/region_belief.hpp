#pragma once

#include <cstddef>
#include <map>
#include <string_view>

#include <ipl_slam/motion_state.hpp>

#include "common/ids.hpp"
#include "common/options.hpp"

namespace ipl_slam {

/// What was seen of a region in one frame.
struct RegionEvidence {
  int points = 0, moved_points = 0;  ///< points that were judged; of these, those that moved
  int lines = 0, moved_lines = 0;
  MotionState contour = MotionState::kCandidate;  ///< verdict of the contour window
  double moved_elsewhere = 0.0;  ///< share of the points outside all regions that seemed to move as well
};

/// Values are log odds: log(p / (1 - p)), 0 = even, 1 = 73 %, 3 = 95 %.
struct RegionBeliefOptions {
  double likely_mover = 1.0;
  double unknown = 1.0;
  double movable = -1.0;
  double background = -3.0;
  double contour = 3.0;
  double moved_on_mover = 0.7;
  double moved_on_still = 0.15;
  double frame_moving = 2.0;
  double frame_still = 0.75;
  double memory = 0.8;
  double most_moving = 5.0;
  double most_still = 3.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number(
        "likely_mover", likely_mover,
        {-10.0, 10.0, "log odds", "that a person, an animal or a vehicle moves, before anything was seen"});
    v.number("unknown", unknown,
             {-10.0, 10.0, "log odds", "the same of what a segmenter without classes found"});
    v.number("movable", movable,
             {-10.0, 10.0, "log odds", "the same of a thing that can be carried or pushed"});
    v.number("background", background,
             {-10.0, 10.0, "log odds", "the same of furniture that hardly ever moves"});
    v.number("contour", contour, {0.0, 10.0, "log odds", "what the verdict of the contour window counts"});
    v.number("moved_on_mover", moved_on_mover,
             {0.01, 0.99, "share", "of the points or lines on something that moves, those found moving"});
    v.number(
        "moved_on_still", moved_on_still,
        {0.01, 0.99, "share",
         "the same on something still: mismatches, noise, moving hands; in frames where more of what lies "
         "outside all regions seems to move (blur, a bad pose), that share"});
    v.number("frame_moving", frame_moving,
             {0.0, 10.0, "log odds",
              "what points and lines of one frame may count at most for motion: they err together"});
    v.number(
        "frame_still", frame_still,
        {0.0, 10.0, "log odds", "and against it: less, since what moves slowly looks still for a while"});
    v.number("memory", memory, {0.0, 1.0, "share", "of what was counted, what is left after a frame"});
    v.number("most_moving", most_moving,
             {0.0, 20.0, "log odds", "what all frames may count at most for motion"});
    v.number(
        "most_still", most_still,
        {0.0, 20.0, "log odds", "and against it: less, since what moves slowly looks still for a while"});
  }
};

/// Believes of each region whether it moves, from all that is known: its class, its contour over the window,
/// the residuals of its points and lines. Each speaks in log odds, which add up (Bayes' rule for independent
/// evidence, as in occupancy grids: Moravec and Elfes, ICRA 1985); what is missing says nothing. So a region
/// without lines, or with hardly any point, can be judged, which the intersection of the paper's Algorithm 1
/// cannot.
class RegionBelief {
 public:
  explicit RegionBelief(const RegionBeliefOptions& options) : options_(options) {}

  /// The belief before anything was seen.
  [[nodiscard]] double prior(std::string_view class_name) const;
  /// Takes what a frame shows of a region; returns the log odds that it moves. Frames are numbers of source
  /// frames.
  double update(InstanceId id, std::size_t frame, std::string_view class_name,
                const RegionEvidence& evidence);
  /// The log odds of the last update; the prior of a region not seen before.
  [[nodiscard]] double of(InstanceId id, std::string_view class_name) const;
  /// Drops regions that were not seen since a frame.
  void forget_before(std::size_t frame);

 private:
  struct Record {
    std::size_t frame = 0;
    double counted = 0.0;  // of points and lines
    double belief = 0.0;
  };
  [[nodiscard]] double log_likelihood(int all, int moved, double moved_elsewhere) const;

  RegionBeliefOptions options_;
  std::map<InstanceId, Record> records_;
};

}  // namespace ipl_slam
