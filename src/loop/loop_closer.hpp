#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "common/options.hpp"
#include "loop/loop_correction.hpp"
#include "loop/place_index.hpp"
#include "loop/place_verifier.hpp"

namespace ipl_slam {

struct LoopOptions {
  bool enabled = true;
  int min_shared = 15;
  int confirmations = 2;
  int witnesses = 5;
  double drift = 0.03;
  double drift_margin = 0.3;
  double drift_angle = 1.0;
  double drift_angle_margin = 5.0;
  double rival_share = 0.7;
  double rival_distance = 0.5;
  double rival_angle = 15.0;
  int pause = 5;
  PlaceIndexOptions index;
  PlaceVerifierOptions verifier;
  LoopCorrectionOptions correction;
  BundleOptions global_bundle;

  template <class Visitor>
  void visit(Visitor& v) {
    v.flag(
        "enabled", enabled,
        "recognise known places: close loops, find the camera again anywhere in the map, join parts of it");
    v.number(
        "min_shared", min_shared,
        {1, 1000, "count",
         "keyframes that share this many landmarks, and the neighbours of these, know each other's place"});
    v.number("confirmations", confirmations,
             {0, 10, "count",
              "further keyframes that must see the recognised place where the hypothesis puts them"});
    v.number("witnesses", witnesses,
             {0, 50, "count", "neighbours of the keyframe that are asked to confirm"});
    v.number(
        "drift", drift,
        {0.0, 1.0, "ratio",
         "error the way between two visits may have gathered, per length: a loop that says more is none"});
    v.number("drift_margin", drift_margin, {0.0, 10.0, "m", "and beyond that"});
    v.number("drift_angle", drift_angle, {0.0, 90.0, "deg/m", "the same of the direction"});
    v.number("drift_angle_margin", drift_angle_margin, {0.0, 180.0, "deg", "and beyond that"});
    v.number("rival_share", rival_share,
             {0.0, 1.01, "ratio",
              "a place is ambiguous when another one has this share of its inliers; above 1 = no check"});
    v.number("rival_distance", rival_distance,
             {0.0, 100.0, "m", "two poses so far apart are of different places ..."});
    v.number("rival_angle", rival_angle, {0.0, 180.0, "deg", "... or turned by this"});
    v.number("pause", pause, {0, 1000, "keyframes", "after a loop was closed none is looked for"});
    v.section("index", index, "search for keyframes that look alike");
    v.section("verifier", verifier, "comparison of a view with such a keyframe");
    v.section("correction", correction, "the map brought in line with a recognised place");
    v.section("global_bundle", global_bundle, "bundle adjustment of all of the map after a loop was closed");
  }
};

/// Knows the places of a map: recognises them when a keyframe comes back to one (paper, figure 2). A
/// look-alike must not pass: beside the verification of the view itself a place is believed when neighbouring
/// keyframes confirm it, no other place explains the view nearly as well, and the way between the two visits
/// can have gathered the error.
class LoopCloser {
 public:
  LoopCloser(const Camera& camera, const ScalePyramid& pyramid, const DepthNoiseOptions& noise,
             const LoopOptions& options, const PoseOptimizerOptions& pose, std::uint64_t seed = 0);

  /// Takes note of all keyframes of a map that it does not know yet, such as one that was loaded.
  void learn(const Map& map);
  /// Looks whether keyframe `id`, just mapped, shows a place that is known without its being connected to
  /// it.
  [[nodiscard]] std::optional<PlaceMatch> look_for_loop(const Map& map, KeyframeId id);
  /// Where in the map, in whatever part of it, a lost frame was taken.
  [[nodiscard]] std::optional<PlaceMatch> find(const Map& map, const PlaceView& view) const;

 private:
  [[nodiscard]] std::set<KeyframeId> connected(const Map& map, KeyframeId id) const;
  [[nodiscard]] std::vector<PlaceMatch> matches(const Map& map, const PlaceView& view,
                                                const std::set<KeyframeId>& excluded) const;
  [[nodiscard]] std::optional<PlaceMatch> unrivalled(const Map& map, std::vector<PlaceMatch> found) const;
  [[nodiscard]] bool plausible(const Map& map, KeyframeId id, const PlaceMatch& match) const;
  [[nodiscard]] bool confirmed(const Map& map, KeyframeId id, const PlaceMatch& match) const;
  void note(const Map& map, KeyframeId id);

  LoopOptions options_;
  PlaceIndex index_;
  PlaceVerifier verifier_;
  std::set<KeyframeId> known_;  // those in the index
  int keyframes_to_wait_ = 0;   // since a loop was closed
};

}  // namespace ipl_slam
