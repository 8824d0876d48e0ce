// The kidnapped camera: blindfolded or elsewhere for a while, then back at a known place from another side.

#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "common/random.hpp"
#include "pipeline/pipeline.hpp"
#include "support/kidnapping.hpp"

namespace ipl_slam {
namespace {

using testing::KnownWalk;
using testing::PlacedFrame;
using testing::recorded;
using Cut = SplicedSource::Cut;

/// What the camera sees while it is carried away.
enum class Sight : std::size_t { kNothing, kElsewhere, kSmear };

/// A place that gets known, and what may be seen on the way.
struct World {
  KnownWalk home;
  std::vector<RgbdFrame> elsewhere, smear;

  [[nodiscard]] const std::vector<RgbdFrame>& frames(Sight sight) const {
    return sight == Sight::kNothing ? home.frames : sight == Sight::kElsewhere ? elsewhere : smear;
  }
};

struct Kidnapping {
  Sight sight;
  std::size_t length;   // frames
  std::size_t back_to;  // frame of the known walk

  [[nodiscard]] Cut away() const {
    return {static_cast<std::size_t>(sight), 0, length - 1, sight == Sight::kNothing};
  }
};

/// A walk through the first `known` frames, then one kidnapping after the other.
struct Story {
  std::size_t known;
  std::vector<Kidnapping> kidnappings;
};

constexpr std::size_t kStay = 12;    // frames it is left in peace when it is back
constexpr std::size_t kWithin = 10;  // frames in which it must know where it is

/// What stories are drawn from; a world without smeared frames has none in its stories.
struct StoryRange {
  int least_known, most_known, longest_away;  // frames
};

Story random_story(const World& world, std::uint64_t seed, const StoryRange& range) {
  Random random(seed);
  const int known = random.uniform_int(range.least_known, range.most_known);
  Story story{static_cast<std::size_t>(known), {}};
  for (int i = 0; i < 5; ++i) {
    const auto sight = static_cast<Sight>(random.index(world.smear.empty() ? 2 : 3));
    const auto length = static_cast<std::size_t>(random.uniform_int(5, range.longest_away));
    const auto back_to = static_cast<std::size_t>(random.uniform_int(0, known - static_cast<int>(kStay)));
    story.kidnappings.push_back({sight, std::min(length, world.frames(sight).size()), back_to});
  }
  return story;
}

/// Frames until a pose in the part of the map that was begun at home which is right to `tolerance`, m;
/// nothing where that took too long.
std::optional<std::size_t> frames_to_find(const World& world, const PlacedFrame& last_known,
                                          const PlacedFrame* back, double tolerance) {
  for (std::size_t i = 0; i < kWithin; ++i) {
    if (!back[i].tracked || back[i].part != last_known.part) continue;
    const double error =
        testing::way_error(last_known.T_wc, back[i].T_wc, world.home.T_wc[last_known.origin.index],
                           world.home.T_wc[back[i].origin.index]);
    if (error <= tolerance) return i + 1;
  }
  return std::nullopt;
}

struct Tally {
  int trials = 0, found = 0, at_once = 0;
};

void play(const World& world, const Story& story, double tolerance, Tally& tally) {
  std::vector<Cut> cuts{{0, 0, story.known - 1}};
  for (const Kidnapping& kidnapping : story.kidnappings) {
    cuts.push_back(kidnapping.away());
    cuts.push_back({0, kidnapping.back_to, kidnapping.back_to + kStay - 1});
  }
  SplicedSource source = testing::splice({&world.home.frames, &world.elsewhere, &world.smear}, cuts);
  Pipeline pipeline(world.home.camera, Config{});
  const std::vector<PlacedFrame> placed = testing::play(source, pipeline);

  std::size_t begin = story.known;
  for (const Kidnapping& kidnapping : story.kidnappings) {
    begin += kidnapping.length;
    const auto frames = frames_to_find(world, placed[story.known - 1], &placed[begin], tolerance);
    begin += kStay;
    ++tally.trials;
    tally.found += frames ? 1 : 0;
    tally.at_once += frames == 1U ? 1 : 0;
    fmt::print("known {} frames, away {} ({}), back at {}: {}\n", story.known, kidnapping.length,
               kidnapping.away().covered           ? "black"
               : kidnapping.sight == Sight::kSmear ? "smear"
                                                   : "elsewhere",
               kidnapping.back_to, frames ? fmt::format("found in frame {}", *frames) : "NOT FOUND");
  }
}

/// Stories of five kidnappings each; more of them with $IPL_SLAM_KIDNAPPING_STORIES.
Tally play_random_stories(const World& world, const StoryRange& range, double tolerance) {
  const char* asked = std::getenv("IPL_SLAM_KIDNAPPING_STORIES");
  const int stories = asked != nullptr ? std::atoi(asked) : 2;
  Tally tally;
  for (int seed = 0; seed < stories; ++seed) {
    play(world, random_story(world, static_cast<std::uint64_t>(seed), range), tolerance, tally);
  }
  fmt::print("found {} of {}, {} in the first frame\n", tally.found, tally.trials, tally.at_once);
  return tally;
}

// Poses in these pictures are good to 5 mm. Takes seconds: two stories of 250 frames are tracked.
TEST(KidnappedCamera, KnowsARenderedRoomWithinTenFrames) {
  World world{testing::rendered_walk(testing::small_room(60)), {}, {}};
  SyntheticOptions other_room = testing::small_room(75, "sweep");
  other_room.seed = 7;
  world.elsewhere = testing::render_all(other_room);
  const Tally tally = play_random_stories(world, {40, 60, 75}, 0.03);
  EXPECT_GE(tally.found, 0.95 * tally.trials);
}

// The true poses themselves are good to about a centimetre relative to the images. Takes up to a minute.
TEST(KidnappedCamera, KnowsARealDeskWithinTenFrames) {
  if (recorded("fr1_xyz_walking").empty()) GTEST_SKIP() << "no $IPL_SLAM_DATA/fr1_xyz_walking";
  if (recorded("fr3_walking_halfsphere_49").empty()) {
    GTEST_SKIP() << "no $IPL_SLAM_DATA/fr3_walking_halfsphere_49";
  }
  World world{testing::recorded_walk(recorded("fr1_xyz_walking")), {}, {}};
  world.elsewhere = testing::recorded_walk(recorded("fr3_walking_halfsphere_49")).frames;
  world.smear = testing::smeared({world.home.frames.begin() + 150, world.home.frames.begin() + 240}, 41);
  const Tally tally = play_random_stories(world, {80, 280, 90}, 0.05);
  EXPECT_GE(tally.found, 0.95 * tally.trials);
}

}  // namespace
}  // namespace ipl_slam
