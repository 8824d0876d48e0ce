#include "loop/loop_closer.hpp"

#include <gtest/gtest.h>

#include "drifted_tour.hpp"

namespace ipl_slam {
namespace {

using namespace test;

// What float pixels and depths leave.
constexpr double kExact = 1e-5;

LoopCloser make_closer(const LoopOptions& options = {}) {
  return {kTestCamera, kTestPyramid, kTestNoise, options, PoseOptimizerOptions{}};
}

SE3 shifted_by(double metres) {
  return SE3(Eigen::Quaterniond::Identity(), {metres, 0.0, 0.0});
}

SE3 turned_by(double degrees) {
  return SE3(
      Eigen::Quaterniond(Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, Eigen::Vector3d::UnitY())),
      Eigen::Vector3d::Zero());
}

// A map of visits to places. Each visit has landmarks of its own, as when the camera comes back unawares.
class Visits {
 public:
  // Adds views of a place, 20 cm apart, where the map has it moved by T_mw from where it is.
  std::vector<KeyframeId> visit(const SyntheticWorld& place, int views = 3, const SE3& T_mw = {},
                                PartId part = PartId{0}) {
    std::vector<KeyframeId> added;
    std::vector<PointId> point_of(place.size());
    for (int i = 0; i < views; ++i) {
      const View view = place.look(camera_at({0.2 * i, 0.0, 0.0}, 0.02 * i), frames_++);
      added.push_back(map.add_keyframe(view.frame, view.T_cw * T_mw.inverse(), nullptr, {}, {}, part));
      for (std::uint32_t k = 0; k < view.sources.size(); ++k) {
        PointId& point = point_of[view.sources[k]];
        if (!point.valid()) {
          point = map.add_point(T_mw * place.position(view.sources[k]), added.back(), k);
        } else {
          map.add_observation(point, added.back(), k);
          map.refresh(point);
        }
      }
    }
    return added;
  }

  Map map{kTestPyramid};

 private:
  std::size_t frames_ = 0;
};

// Whether the last keyframe of a second visit is taken for a loop, when the map has it moved by T_mw.
std::optional<PlaceMatch> loop_after(const SE3& T_mw, const LoopOptions& options = {}) {
  const SyntheticWorld place;
  Visits visits;
  visits.visit(place);
  LoopCloser closer = make_closer(options);
  closer.learn(visits.map);
  return closer.look_for_loop(visits.map, visits.visit(place, 3, T_mw).back());
}

TEST(LoopCloser, FindsTheLoopOfATourAndNothingBeforeIt) {
  const DriftedTour tour;
  LoopCloser closer = make_closer();
  std::optional<PlaceMatch> match;
  std::size_t at = 0;
  for (; at < tour.keyframes.size() && !match; ++at) {
    match = closer.look_for_loop(tour.map, tour.keyframes[at]);
  }
  ASSERT_TRUE(match);
  const std::size_t current = at - 1;
  // It sees 62 degrees; more than so far from where it started it cannot know the place.
  EXPECT_GT(current, DriftedTour::kTurn - 10);
  ASSERT_LT(match->keyframe, KeyframeId{10});
  // Some hundred keypoints of 0.3 px, and landmarks that drifted by less than that over a few keyframes.
  const SE3 right = tour.match(current, match->keyframe.value).T_cw;
  EXPECT_LT(pose_difference(match->T_cw, right), 0.02);
  EXPECT_GT(pose_difference(tour.map.pose_of(tour.keyframes[current]), right), 0.05) << "there was a drift";
}

TEST(LoopCloser, KeyframesThatAreConnectedAreNoLoop) {
  const SyntheticWorld place;
  for (const bool connected : {true, false}) {
    Visits visits;
    LoopOptions options;
    if (!connected) options.min_shared = 100000;
    LoopCloser closer = make_closer(options);
    const std::vector<KeyframeId> keyframes = visits.visit(place, 4);
    bool found = false;
    for (const KeyframeId id : keyframes) found |= closer.look_for_loop(visits.map, id).has_value();
    EXPECT_EQ(found, !connected);
  }
}

TEST(LoopCloser, ALoopSaysWhereTheKeyframeIs) {
  const auto match = loop_after(shifted_by(0.2));
  ASSERT_TRUE(match);
  EXPECT_LT(pose_difference(match->T_cw, camera_at({0.4, 0.0, 0.0}, 0.04)), kExact);
  EXPECT_LT(match->keyframe, KeyframeId{3});
}

TEST(LoopCloser, ADriftThatTheWayCannotHaveGatheredIsNoLoop) {
  LoopOptions lenient;
  lenient.drift = 1.0;
  lenient.drift_angle = 90.0;
  // The way is the 80 cm along the places and, where the map has it so, the jump between them.
  EXPECT_TRUE(loop_after(shifted_by(0.25)));
  EXPECT_FALSE(loop_after(shifted_by(5.0)));
  EXPECT_TRUE(loop_after(shifted_by(5.0), lenient));
  EXPECT_TRUE(loop_after(turned_by(4.0)));
  EXPECT_FALSE(loop_after(turned_by(40.0)));
  EXPECT_TRUE(loop_after(turned_by(40.0), lenient));
}

TEST(LoopCloser, TheLongerTheWayTheMoreDriftIsBelieved) {
  const SyntheticWorld place;
  const SE3 drift = shifted_by(1.5);
  for (const double way : {0.0, 30.0}) {
    Visits visits;
    visits.visit(place);
    if (way > 0.0) visits.map.add_keyframe(SyntheticWorld::make_frame({}), camera_at({-way, 0.0, 0.0}));
    LoopCloser closer = make_closer();
    closer.learn(visits.map);
    EXPECT_EQ(closer.look_for_loop(visits.map, visits.visit(place, 3, drift).back()).has_value(), way > 0.0)
        << "there and back are " << 2.0 * way << " m";
  }
}

TEST(LoopCloser, NeighboursMustConfirm) {
  const SyntheticWorld place;
  for (const int confirmations : {0, 1, 2}) {
    LoopOptions options;
    options.confirmations = confirmations;
    for (const int views : {1, 2, 3}) {
      Visits visits;
      visits.visit(place);
      LoopCloser closer = make_closer(options);
      closer.learn(visits.map);
      const KeyframeId last = visits.visit(place, views, shifted_by(0.1)).back();
      EXPECT_EQ(closer.look_for_loop(visits.map, last).has_value(), views - 1 >= confirmations)
          << views << " views, " << confirmations << " confirmations";
    }
  }
}

TEST(LoopCloser, NeighboursThatSeeAnotherPlaceContradict) {
  const SyntheticWorld place, elsewhere(99);
  for (const int confirmations : {0, 2}) {
    LoopOptions options;
    options.confirmations = confirmations;
    Visits visits;
    Map& map = visits.map;
    visits.visit(place);
    LoopCloser closer = make_closer(options);
    closer.learn(map);
    const KeyframeId last = visits.visit(place, 1, shifted_by(0.1)).back();
    for (std::size_t i = 0; i < 3; ++i) {
      const View other = elsewhere.look(camera_at({0.1, 0.0, 0.0}), 50 + i);
      const KeyframeId neighbour = map.add_keyframe(other.frame, map.pose_of(last));
      for (std::uint32_t k = 0; k < 30; ++k)
        map.add_observation(map.keyframes()[last].points[k], neighbour, k);
    }
    EXPECT_EQ(closer.look_for_loop(map, last).has_value(), confirmations == 0);
  }
}

TEST(LoopCloser, PausesAfterALoop) {
  const SyntheticWorld place;
  Visits visits;
  visits.visit(place);
  LoopOptions options;
  options.pause = 2;
  LoopCloser closer = make_closer(options);
  closer.learn(visits.map);
  const std::vector<KeyframeId> second = visits.visit(place, 6, shifted_by(0.1));
  std::vector<bool> found;
  for (std::size_t i = 2; i < second.size(); ++i) {
    found.push_back(closer.look_for_loop(visits.map, second[i]).has_value());
  }
  EXPECT_EQ(found, (std::vector<bool>{true, false, false, true}));
}

TEST(LoopCloser, AnotherPartMayLieAnywhere) {
  const SyntheticWorld place;
  Visits visits;
  visits.visit(place);
  LoopCloser closer = make_closer();
  closer.learn(visits.map);
  const KeyframeId last = visits.visit(place, 3, shifted_by(50.0), PartId{1}).back();
  const auto match = closer.look_for_loop(visits.map, last);
  ASSERT_TRUE(match);
  EXPECT_EQ(visits.map.part_of(match->keyframe), PartId{0});
  EXPECT_LT(pose_difference(match->T_cw, camera_at({0.4, 0.0, 0.0}, 0.04)), kExact);
}

TEST(LoopCloser, ForgetsKeyframesThatWereTakenOut) {
  const SyntheticWorld place;
  Visits visits;
  const std::vector<KeyframeId> first = visits.visit(place, 4);
  LoopCloser closer = make_closer();
  closer.learn(visits.map);
  const KeyframeId last = visits.visit(place, 3, shifted_by(0.1)).back();
  const auto taken_out = [&](KeyframeId id) { return !visits.map.keyframes().contains(id); };
  for (const std::size_t i : {1U, 2U}) visits.map.remove_keyframe(first[i]);
  // Before it has heard of it as after: a frame like that of keyframe 1, which looks most alike.
  const View view = place.look(camera_at({0.2, 0.0, 0.0}, 0.02), 90);
  const auto found = closer.find(visits.map, {*view.frame});
  ASSERT_TRUE(found);
  EXPECT_FALSE(taken_out(found->keyframe));
  const auto match = closer.look_for_loop(visits.map, last);
  ASSERT_TRUE(match);
  EXPECT_FALSE(taken_out(match->keyframe));
}

TEST(FindPlace, InWhateverPartTheFrameWasTaken) {
  const SyntheticWorld room(1), hall(2);
  Visits visits;
  visits.visit(room);
  visits.visit(hall, 3, shifted_by(7.0), PartId{1});
  LoopCloser closer = make_closer();
  closer.learn(visits.map);
  const SE3 T_cw = camera_at({0.3, -0.1, 0.2}, 0.1, 0.2);
  const auto in_room = closer.find(visits.map, {*room.look(T_cw, 60).frame});
  const auto in_hall = closer.find(visits.map, {*hall.look(T_cw, 61).frame});
  ASSERT_TRUE(in_room && in_hall);
  EXPECT_EQ(visits.map.part_of(in_room->keyframe), PartId{0});
  EXPECT_EQ(visits.map.part_of(in_hall->keyframe), PartId{1});
  EXPECT_LT(pose_difference(in_room->T_cw, T_cw), kExact);
  EXPECT_LT(pose_difference(in_hall->T_cw, T_cw * shifted_by(7.0).inverse()), kExact);
}

TEST(FindPlace, NowhereWhereNothingIsKnown) {
  const SyntheticWorld room(1), garden(3);
  Visits visits;
  LoopCloser closer = make_closer();
  const View view = garden.look(camera_at({0.0, 0.0, 0.0}), 60);
  EXPECT_FALSE(closer.find(visits.map, {*view.frame})) << "an empty map";
  visits.visit(room);
  closer.learn(visits.map);
  EXPECT_FALSE(closer.find(visits.map, {*view.frame}));
  EXPECT_FALSE(closer.find(visits.map, {*SyntheticWorld::make_frame({})}));
  const View known = room.look(camera_at({0.1, 0.0, 0.0}), 61);
  ASSERT_TRUE(closer.find(visits.map, {*known.frame}));
  const FeatureTrust removed{std::vector<double>(known.sources.size(), 0.0), {}};
  EXPECT_FALSE(closer.find(visits.map, {*known.frame, removed})) << "what is removed tells nothing";
}

TEST(FindPlace, TwoPlacesThatLookAlikeAreNone) {
  const SyntheticWorld room;
  const View view = room.look(camera_at({0.1, 0.0, 0.0}, 0.01), 60);
  const auto found = [&](const SE3& T_mw, PartId part, double rival_share) {
    Visits visits;
    visits.visit(room);
    visits.visit(room, 3, T_mw, part);
    LoopOptions options;
    options.rival_share = rival_share;
    LoopCloser closer = make_closer(options);
    closer.learn(visits.map);
    return closer.find(visits.map, {*view.frame}).has_value();
  };
  const double share = LoopOptions{}.rival_share;
  EXPECT_FALSE(found(shifted_by(5.0), PartId{0}, share));
  EXPECT_FALSE(found(turned_by(90.0), PartId{0}, share));
  EXPECT_TRUE(found(shifted_by(5.0), PartId{0}, 1.01)) << "where no rival is feared";
  EXPECT_TRUE(found(shifted_by(0.2), PartId{0}, share)) << "the same place, seen twice with some drift";
  EXPECT_TRUE(found(shifted_by(5.0), PartId{1}, share)) << "another part may show the same place";
}

}  // namespace
}  // namespace ipl_slam
