#include "segmentation/instance_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/median.hpp"
#include "segmentation/assignment.hpp"
#include "segmentation/class_role.hpp"

namespace ipl_slam {
namespace {

constexpr const char* kUnknown = "unknown";
constexpr const char* kPerson = "person";

// Detectors take a chair for a couch, but a person for nothing else: who sits on a chair must not become it.
bool never_one(const std::string& a, const std::string& b) {
  return a != b && (a == kPerson || b == kPerson) && a != kUnknown && b != kUnknown;
}

bool same_class(const std::string& a, const std::string& b) {
  return a == b || a == kUnknown || b == kUnknown;
}

bool overlap_possible(const BitMask& a, const BitMask& b) {
  return !(a.bounding_box() & b.bounding_box()).empty();
}

}  // namespace

const std::string& InstanceTracker::Track::class_name() const {
  return std::max_element(votes.begin(), votes.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

std::vector<TrackedInstance> InstanceTracker::update(const CarryView& view,
                                                     const std::vector<Instance>& detections) {
  advance(view);
  std::vector<Candidate> found = candidates(view, without_duplicates(detections));
  associate(found, true, &InstanceTracker::overlap);
  join_parts(found);
  part_bodies(found);
  associate(found, true, &InstanceTracker::resemblance);
  associate(found, false, &InstanceTracker::resemblance);

  const std::size_t known = tracks_.size();
  std::vector<bool> detected(known, false);
  for (Candidate& candidate : found) {
    if (candidate.instance.mask.none()) continue;  // joined to another
    if (candidate.track < 0) {
      tracks_.emplace_back().id = InstanceId{next_id_++};
      confirm(tracks_.back(), candidate);
    } else {
      detected[static_cast<std::size_t>(candidate.track)] = true;
      confirm(tracks_[static_cast<std::size_t>(candidate.track)], candidate);
    }
  }
  for (std::size_t i = 0; i < known; ++i) {
    if (!detected[i]) miss(tracks_[i], found);
  }
  return in_view();
}

std::vector<TrackedInstance> InstanceTracker::carry(const CarryView& view) {
  advance(view);
  return in_view();
}

// Everything that is remembered moves on to the new frame.
void InstanceTracker::advance(const CarryView& view) {
  if (!view_.pyramid.empty() && view.index <= view_.index) {
    throw std::invalid_argument("instance tracker: frames must come in order");
  }
  const int frames = view_.pyramid.empty() ? 0 : static_cast<int>(view.index - view_.index);
  const std::optional<SE3> T_to_from = motion_between(view_, view);
  std::vector<Track*> visible;
  std::vector<const BitMask*> masks;
  for (Track& track : tracks_) {
    track.frames_carried += frames;
    track.hidden = false;
    if (track.in_sight()) {
      visible.push_back(&track);
      masks.push_back(&track.mask);
    } else if (T_to_from && track.place.z() > 0.0) {
      track.place = *T_to_from * track.place;
    }
  }
  std::vector<CarriedMask> carried;
  if (!masks.empty()) carried = carrier_.carry(view_, masks, view);
  for (std::size_t i = 0; i < visible.size(); ++i) {
    Track& track = *visible[i];
    const bool supported = carried[i].followed ? carried[i].support >= options_.min_support
                                               : carried[i].depth_fit > 1.0 - options_.min_depth_fit;
    const bool there = supported && carried[i].depth_fit >= options_.min_depth_fit &&
                       carried[i].mask.area() >= options_.min_area * track.seen_area &&
                       track.frames_carried <= options_.max_carried;
    track.mask = there ? std::move(carried[i].mask) : BitMask();
    if (there) {
      if (const Eigen::Vector3d place = place_of(view, track.mask); place.z() > 0.0) track.place = place;
    }
  }
  std::erase_if(tracks_,
                [&](const Track& track) { return track.frames_carried > options_.max_out_of_sight; });
  view_ = view;
}

// Best score first, without objects that were found twice and without rims: in a label image nothing else is
// left of a detection that another one covers.
std::vector<Instance> InstanceTracker::without_duplicates(const std::vector<Instance>& detections) const {
  constexpr double kLeastFill = 0.02;  // of the bounding box; no object is that thin
  std::vector<const Instance*> by_score;
  for (const Instance& detection : detections) {
    const int area = detection.mask.area();
    if (area > 0 && area >= kLeastFill * detection.mask.bounding_box().area()) by_score.push_back(&detection);
  }
  std::stable_sort(by_score.begin(), by_score.end(),
                   [](const Instance* a, const Instance* b) { return a->score > b->score; });
  std::vector<Instance> kept;
  for (const Instance* detection : by_score) {
    const bool duplicate = std::any_of(kept.begin(), kept.end(), [&](const Instance& other) {
      return !never_one(other.class_name, detection->class_name) &&
             iou(other.mask, detection->mask) >= options_.duplicate_iou;
    });
    if (!duplicate) kept.push_back(*detection);
  }
  return kept;
}

std::vector<InstanceTracker::Candidate> InstanceTracker::candidates(const CarryView& view,
                                                                    std::vector<Instance> detections) const {
  std::vector<Candidate> result;
  for (Instance& detection : detections) {
    Candidate candidate;
    candidate.appearance = Appearance(view, detection.mask);
    candidate.place = place_of(view, detection.mask);
    candidate.instance = std::move(detection);
    result.push_back(std::move(candidate));
  }
  return result;
}

// Pairs the tracks in sight, or those out of sight, with the detections that have none yet, so that the sum
// of scores is largest. A score of 0 means that they cannot be one.
void InstanceTracker::associate(std::vector<Candidate>& candidates, bool in_sight, Score score) const {
  std::vector<bool> taken(tracks_.size(), false);
  for (const Candidate& candidate : candidates) {
    if (candidate.track >= 0) taken[static_cast<std::size_t>(candidate.track)] = true;
  }
  std::vector<int> tracks, open;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (!taken[i] && tracks_[i].in_sight() == in_sight) tracks.push_back(static_cast<int>(i));
  }
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (candidates[i].track < 0 && !candidates[i].instance.mask.none()) open.push_back(static_cast<int>(i));
  }
  if (tracks.empty() || open.empty()) return;
  Eigen::MatrixXd costs(tracks.size(), open.size());
  for (Eigen::Index i = 0; i < costs.rows(); ++i) {
    for (Eigen::Index j = 0; j < costs.cols(); ++j) {
      costs(i, j) = -(this->*score)(tracks_[static_cast<std::size_t>(tracks[static_cast<std::size_t>(i)])],
                                    candidates[static_cast<std::size_t>(open[static_cast<std::size_t>(j)])]);
    }
  }
  const std::vector<int> column = assign(costs);
  for (std::size_t i = 0; i < column.size(); ++i) {
    if (column[i] < 0 || costs(static_cast<Eigen::Index>(i), column[i]) >= 0.0) continue;
    candidates[static_cast<std::size_t>(open[static_cast<std::size_t>(column[i])])].track = tracks[i];
  }
}

double InstanceTracker::overlap(const Track& track, const Candidate& candidate) const {
  constexpr double kAppearance = 0.2;  // weight of colours, to tell people apart whose masks cross
  const std::string& track_class = track.class_name();
  if (never_one(track_class, candidate.instance.class_name)) return 0.0;
  if (!overlap_possible(track.mask, candidate.instance.mask)) return 0.0;
  double score = iou(track.mask, candidate.instance.mask);
  if (!same_class(track_class, candidate.instance.class_name)) score *= options_.other_class;
  if (score < options_.min_overlap) score = shows_part(track, candidate) ? options_.min_overlap : 0.0;
  if (score == 0.0) return 0.0;
  return score + kAppearance * track.appearance.similarity(candidate.appearance);
}

// Whether the detection lies in the track's mask, at its depth.
bool InstanceTracker::shows_part(const Track& track, const Candidate& candidate) const {
  return same_class(track.class_name(), candidate.instance.class_name) &&
         std::abs(track.place.z() - candidate.place.z()) <= options_.body_depth &&
         intersection_area(track.mask, candidate.instance.mask) >=
             options_.part_inside * candidate.instance.mask.area();
}

double InstanceTracker::resemblance(const Track& track, const Candidate& candidate) const {
  if (!same_class(track.class_name(), candidate.instance.class_name)) return 0.0;
  const double similarity = track.appearance.similarity(candidate.appearance);
  if (similarity < options_.min_similarity) return 0.0;
  if (track.place.z() <= 0.0 || candidate.place.z() <= 0.0) return similarity;
  const double distance = (track.place - candidate.place).norm();
  const double reach = reach_of(track);
  return distance > reach ? 0.0 : similarity + 1.0 - distance / reach;
}

// How far from its last place it can be, m.
double InstanceTracker::reach_of(const Track& track) const {
  constexpr double kBody = 1.0;  // the middle of what is seen of somebody who stays moves by half a body
  constexpr double kThing = 0.25;
  const std::string& name = track.class_name();
  const bool moves_by_itself = name == kUnknown || class_role(name) == ClassRole::likely_mover;
  return moves_by_itself ? kBody + options_.max_speed * (view_.timestamp - track.seen_at) : kThing;
}

// One body in two detections: what no track claims, but lies in another detection, or in the mask of the
// track that has the other detection and at its depth, is a part of that.
void InstanceTracker::join_parts(std::vector<Candidate>& candidates) const {
  const auto is_part_of = [&](const Candidate& part, const Candidate& whole) {
    if (!same_class(whole.instance.class_name, part.instance.class_name)) return false;
    const double area = options_.part_inside * part.instance.mask.area();
    if (intersection_area(whole.instance.mask, part.instance.mask) >= area) return true;
    return whole.track >= 0 && shows_part(tracks_[whole.track], part);
  };
  for (Candidate& part : candidates) {
    if (part.track >= 0) continue;
    for (Candidate& whole : candidates) {
      if (&whole == &part || whole.instance.mask.none() || !is_part_of(part, whole)) continue;
      whole.instance.mask |= part.instance.mask;
      part.instance.mask = BitMask(part.instance.mask.size());
      break;
    }
  }
}

// Two bodies in one detection. Pixels that the track of the detection did not bring along but another track
// of the same kind did are left to that one, whether it has a detection of its own or not.
void InstanceTracker::part_bodies(std::vector<Candidate>& candidates) {
  std::vector<const BitMask*> own(tracks_.size(), nullptr);
  for (const Candidate& candidate : candidates) {
    if (candidate.track >= 0) own[candidate.track] = &candidate.instance.mask;
  }
  std::vector<BitMask> parted;
  for (const Candidate& candidate : candidates) {
    BitMask mask = candidate.instance.mask;
    for (std::size_t i = 0; i < tracks_.size() && candidate.track >= 0; ++i) {
      Track& other = tracks_[i];
      const BitMask& brought = tracks_[candidate.track].mask;
      if (static_cast<int>(i) == candidate.track || !other.in_sight() || brought.size().empty()) continue;
      if (!same_class(other.class_name(), candidate.instance.class_name)) continue;
      BitMask claimed = own[i] != nullptr ? *own[i] : other.mask;
      if (intersection_area(claimed, candidate.instance.mask) < options_.part_inside * claimed.area())
        continue;
      other.hidden = own[i] == nullptr;
      claimed -= brought;
      mask -= claimed;
    }
    parted.push_back(std::move(mask));
  }
  for (std::size_t i = 0; i < candidates.size(); ++i) candidates[i].instance.mask = std::move(parted[i]);
}

void InstanceTracker::confirm(Track& track, const Candidate& candidate) {
  constexpr float kAppearanceRate = 0.1F;  // a look is learnt over about ten sightings
  track.votes[candidate.instance.class_name] += candidate.instance.score;
  track.score = candidate.instance.score;
  if (track.in_sight() && iou(track.mask, candidate.instance.mask) < options_.min_overlap &&
      shows_part(track, candidate)) {
    track.mask |= candidate.instance.mask;  // the rest is there by its depth
  } else {
    track.mask = candidate.instance.mask;
  }
  track.seen_area = track.mask.area();
  track.appearance.blend(candidate.appearance, kAppearanceRate);
  track.place = candidate.place;
  ++track.detections;
  track.misses = 0;
  track.frames_carried = 0;
  track.seen_at = view_.timestamp;
}

// The mask is carried on where no detected instance lies. What was detected a few times only is given up
// after as many misses: it may have been nothing. To be hidden in the detection of another is no miss.
void InstanceTracker::miss(Track& track, const std::vector<Candidate>& candidates) {
  for (const Candidate& candidate : candidates) {
    if (!track.in_sight() || !overlap_possible(track.mask, candidate.instance.mask)) continue;
    track.mask -= candidate.instance.mask;
  }
  if (!track.hidden) ++track.misses;
  if (track.in_sight() &&
      (track.misses > track.detections || track.mask.area() < options_.min_area * track.seen_area)) {
    track.mask = BitMask();
  }
}

// The middle of a mask at its median depth.
Eigen::Vector3d InstanceTracker::place_of(const CarryView& view, const BitMask& mask) const {
  constexpr int kStep = 4;  // pixels; a sample of the mask does
  std::vector<int> depths;
  Eigen::Vector2d sum(0, 0);
  const cv::Rect box = mask.bounding_box();
  for (int y = box.y; y < box.br().y; y += kStep) {
    for (int x = box.x; x < box.br().x; x += kStep) {
      if (!mask.test(x, y) || view.depth.at<std::uint16_t>(y, x) == 0) continue;
      depths.push_back(view.depth.at<std::uint16_t>(y, x));
      sum += Eigen::Vector2d(x, y);
    }
  }
  if (depths.empty()) return {0, 0, 0};
  return camera_.unproject(camera_.undistort(sum / static_cast<double>(depths.size())),
                           median(depths) / camera_.depth_scale);
}

std::vector<TrackedInstance> InstanceTracker::in_view() const {
  std::vector<TrackedInstance> result;
  for (const Track& track : tracks_) {
    if (!track.in_sight()) continue;
    result.push_back({track.id,
                      {track.class_name(), track.score, track.mask.bounding_box(), track.mask},
                      track.frames_carried});
  }
  return result;
}

}  // namespace ipl_slam
