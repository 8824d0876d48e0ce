#include "map/map_bytes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "map/map_records.hpp"

namespace ipl_slam {
namespace {

constexpr std::uint32_t kVersion = 1;
// The first byte is no text, and the line ends show whether somebody translated them on the way.
constexpr std::string_view kMagic = "\x89IPM\r\n\x1A\n";
enum Section : std::size_t { kCamera, kPyramid, kKeyframes, kPoints, kLines, kLoops, kSections };

// Image pyramids that make sense (orb.levels and orb.scale_factor lie within).
constexpr int kMostLevels = 32;
constexpr double kLargestFactor = 4.0;

template <class Archive>
void pyramid_record(Archive& a, int& levels, double& factor) {
  a.template whole<std::uint8_t>(levels, 1, kMostLevels, "the number of pyramid levels");
  a.real(factor, std::nextafter(1.0, 2.0), kLargestFactor, "the pyramid's factor");
}

/// Counts ids anew: of those there are, and for one that is gone the next there is.
class NewIds {
 public:
  explicit NewIds(const Map& map) : of_(map.keyframes().ids_used() + 1) {
    map.keyframes().for_each([this](KeyframeId id, const Keyframe&) { of_[id.value + 1] = 1; });
    for (std::size_t i = 1; i < of_.size(); ++i) of_[i] += of_[i - 1];
  }
  [[nodiscard]] KeyframeId operator()(KeyframeId id) const { return KeyframeId{of_[id.value]}; }

 private:
  std::vector<std::uint32_t> of_;  // per id: how many came before it
};

template <class Landmark>
Landmark with_new_ids(const NewIds& new_ids, Landmark landmark) {
  landmark.first_keyframe = new_ids(landmark.first_keyframe);
  for (Observation& o : landmark.observations) o.keyframe = new_ids(o.keyframe);
  return landmark;
}

/// The name stands in messages of one line.
Camera with_plain_name(Camera camera) {
  std::replace_if(camera.name.begin(), camera.name.end(), is_control, ' ');
  return camera;
}

void write_keyframes(RecordWriter& out, const Map& map) {
  const std::vector<PartId> parts = map.parts();
  out.count(map.keyframes().size(), kKeyframeBytes, "");
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    const auto part = std::lower_bound(parts.begin(), parts.end(), keyframe.part) - parts.begin();
    const Frame& frame = *keyframe.frame;
    const KeyframeRecord record{keyframe.T_cw,
                                PartId{static_cast<std::uint32_t>(part)},
                                frame.index,
                                frame.timestamp,
                                frame.features,
                                keyframe.point_trust.weights,
                                *keyframe.line_features,
                                keyframe.line_trust.weights};
    keyframe_record(out, record, map.pyramid().levels());
  });
}

using Require = void (*)(bool, std::string_view, std::string_view);
constexpr Require require = &RecordReader::require;

void read_keyframes(RecordReader& in, Map& map) {
  const std::uint32_t count = in.count(0, kKeyframeBytes, "the keyframes");
  for (std::uint32_t i = 0; i < count; ++i) {
    KeyframeRecord record;
    keyframe_record(in, record, map.pyramid().levels());
    // Parts count in the order of their oldest keyframes.
    require(record.part <= map.new_part(), "a keyframe", "belongs to a part that no keyframe started");
    FeatureGrid grid(record.features);
    auto frame = std::make_shared<const Frame>(
        Frame{record.index, record.timestamp, std::move(record.features), std::move(grid)});
    map.add_keyframe(
        std::move(frame), record.T_cw, std::make_shared<const LineFeatures>(std::move(record.lines)),
        {std::move(record.point_weights), {}}, {std::move(record.line_weights), {}}, record.part);
  }
}

/// What Map::restore asks of a landmark.
template <class LandmarkId, class Landmark>
void check_observations(const Map& map, const Landmark& landmark, std::vector<LandmarkId> Keyframe::*seen,
                        FeatureTrust Keyframe::*trust) {
  const std::vector<Observation>& observations = landmark.observations;
  require(!observations.empty(), "a landmark", "is seen by no keyframe");
  const PartId part = map.keyframes()[observations.front().keyframe].part;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const Observation& o = observations[i];
    const Keyframe& keyframe = map.keyframes()[o.keyframe];
    require(i == 0 || observations[i - 1].keyframe < o.keyframe, "the observations", "are out of order");
    require(keyframe.part == part, "a landmark", "is seen from two parts of the map");
    require(o.feature < (keyframe.*seen).size(), "an observation", "is of a feature that is not there");
    require(!(keyframe.*seen)[o.feature].valid(), "a feature", "belongs to two landmarks");
    require((keyframe.*trust).weight(o.feature) > 0.0, "an observation", "is of a feature that was removed");
  }
}

void read_points(RecordReader& in, Map& map) {
  const std::uint32_t count = in.count(0, kPointBytes, "the points");
  for (std::uint32_t i = 0; i < count; ++i) {
    Point point;
    point_record(in, point, map.keyframes().size());
    check_observations(map, point, &Keyframe::points, &Keyframe::point_trust);
    const PointId id = map.restore(std::move(point));
    require(map.points()[id].min_distance > 0.0, "a point", "lies in the cameras that see it");
  }
}

void check_place(const Line& line) {
  // Rounding of directions, and a micrometre within some metres of the origin.
  constexpr double kDirection = 1e-9, kDistance = 1e-6;
  const Line3& l = line.line;
  require(std::abs(l.direction.norm() - 1.0) < kDirection, "a line", "has a direction that is none");
  require(std::abs(l.direction.dot(l.moment)) < kDirection, "a line", "has a moment along its direction");
  require(l.distance(line.start) < kDistance && l.distance(line.end) < kDistance, "a line",
          "ends beside itself");
  require(l.direction.dot(line.end - line.start) > 0.0, "a line", "runs backwards");
}

void read_lines(RecordReader& in, Map& map) {
  const std::uint32_t count = in.count(0, kLineBytes, "the lines");
  for (std::uint32_t i = 0; i < count; ++i) {
    Line line;
    line_record(in, line, map.keyframes().size());
    check_place(line);
    check_observations(map, line, &Keyframe::lines, &Keyframe::line_trust);
    map.restore(std::move(line));
  }
}

void read_loops(RecordReader& in, Map& map) {
  const std::uint32_t count = in.count(0, kLoopBytes, "the loops");
  for (std::uint32_t i = 0; i < count; ++i) {
    LoopEdge edge;
    loop_record(in, edge, map.keyframes().size());
    require(edge.a != edge.b, "a loop", "joins a keyframe with itself");
    require(map.part_of(edge.a) == map.part_of(edge.b), "a loop", "joins two parts of the map");
    map.add_loop(edge);
  }
}

/// Reads one section to its end; what is wrong with it is said with the place.
template <class Read>
void read_section(Section section, const std::vector<std::string_view>& contents, const Read& read) {
  RecordReader in(contents[section]);
  const auto fail = [&](const char* what) {
    throw FormatError(fmt::format("is damaged: section {}, byte {}: {}; copy or save it again",
                                  map_format().sections[section], in.bytes().position(), what));
  };
  try {
    read(in);
    require(in.bytes().remaining() == 0, "more", "follows than announced");
  } catch (const FormatError& error) {
    fail(error.what());
  } catch (const UserError& error) {  // of Camera::check
    fail(error.what());
  }
}

}  // namespace

const SectionedFormat& map_format() {
  static const SectionedFormat format{
      kMagic, kVersion, "map", {"CAMR", "PYRA", "KEYF", "PNTS", "LINS", "LOOP"}};
  return format;
}

std::string encode_map(const Map& map, const Camera& camera) {
  std::array<RecordWriter, kSections> out;
  const Camera named = with_plain_name(camera);
  camera_record(out[kCamera], named);
  int levels = map.pyramid().levels();
  double factor = map.pyramid().factor();
  pyramid_record(out[kPyramid], levels, factor);
  write_keyframes(out[kKeyframes], map);

  const NewIds new_ids(map);
  const std::size_t keyframes = map.keyframes().size();
  out[kPoints].count(map.points().size(), kPointBytes, "");
  map.points().for_each([&](PointId, const Point& point) {
    const Point saved = with_new_ids(new_ids, point);
    point_record(out[kPoints], saved, keyframes);
  });
  out[kLines].count(map.lines().size(), kLineBytes, "");
  map.lines().for_each([&](LineId, const Line& line) {
    const Line saved = with_new_ids(new_ids, line);
    line_record(out[kLines], saved, keyframes);
  });
  out[kLoops].count(map.loops().size(), kLoopBytes, "");
  for (LoopEdge edge : map.loops()) {
    edge.a = new_ids(edge.a), edge.b = new_ids(edge.b);
    loop_record(out[kLoops], edge, keyframes);
  }
  std::array<std::string, kSections> contents;
  for (std::size_t i = 0; i < kSections; ++i) contents[i] = out[i].take();
  return pack_sections(map_format(), contents);
}

SavedMap decode_map(std::string_view bytes) {
  const std::vector<std::string_view> contents = unpack_sections(map_format(), bytes);
  Camera camera;
  read_section(kCamera, contents, [&](RecordReader& in) {
    camera_record(in, camera);
    camera.check();
  });
  int levels = 1;
  double factor = 1.0;
  read_section(kPyramid, contents, [&](RecordReader& in) { pyramid_record(in, levels, factor); });
  Map map(ScalePyramid(levels, factor));
  read_section(kKeyframes, contents, [&](RecordReader& in) { read_keyframes(in, map); });
  read_section(kPoints, contents, [&](RecordReader& in) { read_points(in, map); });
  read_section(kLines, contents, [&](RecordReader& in) { read_lines(in, map); });
  read_section(kLoops, contents, [&](RecordReader& in) { read_loops(in, map); });
  return {std::move(camera), std::move(map)};
}

}  // namespace ipl_slam
