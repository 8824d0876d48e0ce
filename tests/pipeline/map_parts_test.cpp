// Parts of a map that were recorded apart, and how they become one.

#include <cmath>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "pipeline/pipeline.hpp"
#include "support/kidnapping.hpp"

namespace ipl_slam {
namespace {

using testing::KnownWalk;
using testing::PlacedFrame;
using Cut = SplicedSource::Cut;

/// A walk, and the same walk backwards.
struct RoundTrip {
  KnownWalk out;
  std::vector<RgbdFrame> back;

  explicit RoundTrip(KnownWalk walk) : out(std::move(walk)), back(testing::reversed(out.frames)) {}

  [[nodiscard]] SplicedSource splice(const std::vector<Cut>& cuts) const {
    return testing::splice({&out.frames, &back}, cuts);
  }
  /// Walks from frame `from` down to `to`.
  [[nodiscard]] Cut homewards(std::size_t from, std::size_t to) const {
    return {1, back.size() - 1 - from, back.size() - 1 - to};
  }
  /// The frame of the walk out that shows the same.
  [[nodiscard]] std::size_t frame(const SplicedSource::Origin& origin) const {
    return origin.source == 0 ? origin.index : back.size() - 1 - origin.index;
  }
};

/// A third of a round about the room, in big steps.
const RoundTrip& round_the_room() {
  static const RoundTrip trip = [] {
    SyntheticOptions options = testing::small_room(100, "orbit");
    options.fps = 12.0;
    return RoundTrip(testing::rendered_walk(options));
  }();
  return trip;
}

constexpr std::size_t kHome = 32;  // frames of it that are walked first

/// The first of it; three seconds in the dark; then from the far end back to where it began.
SplicedSource two_parts(const RoundTrip& trip) {
  return trip.splice({{0, 0, kHome}, {0, 0, 36, true}, trip.homewards(99, 12)});
}

std::optional<SE3> pose_of(const Trajectory& trajectory, double timestamp) {
  for (const StampedPose& pose : trajectory) {
    if (std::abs(pose.timestamp - timestamp) < 1e-6) return pose.T_wc;
  }
  return std::nullopt;
}

/// Largest error of the way from a frame seen before the dark to one of the same walk seen after it, over
/// frames that lie no more than `within` frames apart in the walk, m. `pairs` tells how many there were.
double seam_error(const RoundTrip& trip, const SplicedSource& source, std::size_t dark,
                  const Trajectory& trajectory, std::size_t within, int& pairs) {
  double worst = 0.0;
  for (std::size_t a = 0; a < dark; ++a) {
    const auto T_wa = pose_of(trajectory, source.timestamp(a));
    if (!T_wa) continue;
    for (std::size_t b = dark; b < source.size(); ++b) {
      if (source.origin(b).covered) continue;
      const std::size_t frame_a = trip.frame(source.origin(a)), frame_b = trip.frame(source.origin(b));
      const auto T_wb = pose_of(trajectory, source.timestamp(b));
      if (!T_wb || std::max(frame_a, frame_b) - std::min(frame_a, frame_b) > within) continue;
      ++pairs;
      worst =
          std::max(worst, testing::way_error(*T_wa, *T_wb, trip.out.T_wc[frame_a], trip.out.T_wc[frame_b]));
    }
  }
  return worst;
}

int count(const Pipeline& pipeline, PlaceEvent::Kind kind) {
  int count = 0;
  for (const PlaceEvent& event : pipeline.mapping().events()) count += event.kind == kind ? 1 : 0;
  return count;
}

// 5 mm were measured.
TEST(MapParts, OfARenderedRoomThatWereRecordedApartBecomeOne) {
  const RoundTrip& trip = round_the_room();
  SplicedSource source = two_parts(trip);
  Pipeline pipeline(trip.out.camera, Config{});
  const std::vector<PlacedFrame> placed = testing::play(source, pipeline);
  pipeline.finish();
  const PlacedFrame& first_after_the_dark = placed[kHome + 1 + 37];
  ASSERT_TRUE(first_after_the_dark.tracked);
  ASSERT_NE(first_after_the_dark.part, placed[0].part) << "nothing was recorded apart: this shows nothing";
  EXPECT_EQ(count(pipeline, PlaceEvent::Kind::kMerge), 1);
  ASSERT_EQ(pipeline.trajectory_parts().size(), 1U);
  int pairs = 0;
  EXPECT_LE(seam_error(trip, source, kHome + 1, pipeline.trajectory(), 3, pairs), 0.03);
  EXPECT_GT(pairs, 50);
}

}  // namespace
}  // namespace ipl_slam
