// Parts of a map that were recorded apart, and how they become one.

#include <cmath>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include <ipl_slam/error.hpp>

#include "dataset/temporary_folder.hpp"
#include "map/map_file.hpp"
#include "pipeline/loaded_map.hpp"
#include "pipeline/pipeline.hpp"
#include "support/kidnapping.hpp"

namespace ipl_slam {
namespace {

using testing::content_of;
using testing::KnownWalk;
using testing::PlacedFrame;
using testing::TemporaryFolder;
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
  const double error = seam_error(trip, source, kHome + 1, pipeline.trajectory(), 3, pairs);
  ::testing::Test::RecordProperty("seam_mm", std::to_string(1000.0 * error));
  EXPECT_LE(error, 0.03);
  EXPECT_GT(pairs, 50);
}

void save(const std::filesystem::path& file, const Pipeline& pipeline) {
  pipeline.mapping().read(
      [&](const Map& map, const std::vector<MappingRecord>&) { save_map(file, map, pipeline.camera()); });
}

// Takes seconds: the sequence is tracked twice more.
TEST(MapParts, AreTheSameBytesAgainAndWithAnyNumberOfThreads) {
  const RoundTrip& trip = round_the_room();
  const TemporaryFolder folder;
  const auto written = [&](int threads) {
    Config config;
    config.schedule.threads = threads;
    SplicedSource source = two_parts(trip);
    Pipeline pipeline(trip.out.camera, config);
    (void)testing::play(source, pipeline);
    pipeline.finish();
    save(folder / "map", pipeline);
    return trajectory_text(pipeline.trajectory_parts()) + content_of(folder / "map");
  };
  EXPECT_TRUE(written(1) == written(2));
}

// The same frames a second time, in the running map and in the one that was saved and loaded.
TEST(LoadedMap, GivesThePosesOfTheRunningOneAndIsLeftAloneWhereOnlyPlacesAreAskedFor) {
  const RoundTrip& trip = round_the_room();
  const TemporaryFolder folder;
  SplicedSource first = trip.splice({{0, 0, kHome}});
  SplicedSource second = trip.splice({{0, 0, kHome}, {0, 0, kHome}});
  Pipeline running(trip.out.camera, Config{});
  (void)testing::play(first, running);
  running.finish();
  save(folder / "map", running);
  for (std::size_t i = 0; i <= kHome; ++i) (void)second.next();
  const std::vector<PlacedFrame> expected = testing::play(second, running);

  for (const bool localize_only : {false, true}) {
    SplicedSource again = trip.splice({{0, 0, kHome}});
    Pipeline loaded(trip.out.camera, Config{}, load_fitting_map(folder / "map", trip.out.camera, Config{}),
                    localize_only);
    const std::vector<PlacedFrame> placed = testing::play(again, loaded);
    loaded.finish();
    for (std::size_t i = 0; i < placed.size(); ++i) {
      ASSERT_TRUE(placed[i].tracked && expected[i].tracked) << i;
      EXPECT_LE((placed[i].T_wc.translation() - expected[i].T_wc.translation()).norm(), 0.005) << i;
    }
    save(folder / "after", loaded);
    EXPECT_EQ(content_of(folder / "after") == content_of(folder / "map"), localize_only);
  }
}

// The camera is put down on the far side of the room, where it is lost and begins anew.
TEST(LoadedMap, IsJoinedByACameraThatBeganOutsideOfIt) {
  const RoundTrip& trip = round_the_room();
  const TemporaryFolder folder;
  {
    SplicedSource first = trip.splice({{0, 0, kHome}});
    Pipeline pipeline(trip.out.camera, Config{});
    (void)testing::play(first, pipeline);
    pipeline.finish();
    save(folder / "map", pipeline);
  }
  SplicedSource homewards = trip.splice({trip.homewards(99, 12)});
  Config impatient;  // within two seconds it would come near enough to be found
  impatient.tracking.new_part_after = 0.5;
  Pipeline pipeline(trip.out.camera, impatient, load_fitting_map(folder / "map", trip.out.camera, impatient));
  const std::vector<PlacedFrame> placed = testing::play(homewards, pipeline);
  pipeline.finish();
  EXPECT_FALSE(placed.front().tracked);
  EXPECT_EQ(count(pipeline, PlaceEvent::Kind::kMerge), 1);
  EXPECT_EQ(pipeline.trajectory_parts().size(), 1U);
  pipeline.mapping().read(
      [](const Map& map, const std::vector<MappingRecord>&) { EXPECT_EQ(map.parts().size(), 1U); });
}

TEST(LoadedMap, OfAnotherCameraIsRefused) {
  const TemporaryFolder folder;
  Pipeline pipeline(testing::small_camera(), Config{});
  for (const RgbdFrame& frame : testing::render_all(testing::small_room(2))) (void)pipeline.process(frame);
  save(folder / "map", pipeline);
  Camera other = testing::small_camera();
  other.fx += 1.0;
  EXPECT_THROW((void)load_fitting_map(folder / "map", other, Config{}), UserError);
  EXPECT_NO_THROW((void)load_fitting_map(folder / "map", testing::small_camera(), Config{}));
}

}  // namespace
}  // namespace ipl_slam
