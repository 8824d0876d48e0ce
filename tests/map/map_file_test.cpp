// Saving and loading a map.
#include "map/map_file.hpp"

#include <algorithm>
#include <csignal>
#include <functional>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <ipl_slam/error.hpp>

#include "common/random.hpp"
#include "dataset/temporary_folder.hpp"
#include "map/map_bytes.hpp"
#include "support/bare_frame.hpp"
#include "support/eventful_map.hpp"
#include "support/map_checks.hpp"

namespace ipl_slam {
namespace {

using namespace test;
using ::testing::AllOf;
using testing::content_of;
using ::testing::HasSubstr;
using testing::message_of;
using testing::TemporaryFolder;

void expect_equal(const Features& a, const Features& b) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(a.descriptors, b.descriptors);
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Keypoint &k = a.keypoints[i], &l = b.keypoints[i];
    EXPECT_EQ(k.pixel, l.pixel);
    EXPECT_EQ(k.undistorted, l.undistorted);
    EXPECT_EQ(k.angle, l.angle);
    EXPECT_EQ(k.response, l.response);
    EXPECT_EQ(k.depth, l.depth);
    EXPECT_EQ(k.level, l.level);
  }
}

void expect_equal(const LineFeatures& a, const LineFeatures& b) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(a.descriptors, b.descriptors);
  for (std::size_t i = 0; i < a.size(); ++i) {
    const LineSegment &s = a.segments[i], &t = b.segments[i];
    EXPECT_EQ(s.start_pixel, t.start_pixel);
    EXPECT_EQ(s.end_pixel, t.end_pixel);
    EXPECT_EQ(s.start, t.start);
    EXPECT_EQ(s.end, t.end);
    EXPECT_EQ(s.contrast, t.contrast);
    EXPECT_EQ(s.octave, t.octave);
    EXPECT_EQ(s.depth.inverse_start, t.depth.inverse_start);
    EXPECT_EQ(s.depth.inverse_end, t.depth.inverse_end);
    EXPECT_EQ(s.depth.covariance, t.depth.covariance);
  }
}

void expect_equal(const SE3& a, const SE3& b) {
  EXPECT_EQ(a.rotation().coeffs(), b.rotation().coeffs());
  EXPECT_EQ(a.translation(), b.translation());
}

/// The n-th record that there is.
template <class Id, class Record>
const Record& nth(const Store<Id, Record>& store, std::size_t n) {
  const Record* found = nullptr;
  store.for_each([&](Id, const Record& record) {
    if (n-- == 0) found = &record;
  });
  return *found;
}

KeyframeId id_of(const Map& map, std::size_t n) {
  KeyframeId found;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe&) {
    if (n-- == 0) found = id;
  });
  return found;
}

template <class Landmark>
void expect_equal_landmarks(const Map& saved, const Landmark& a, const Landmark& b) {
  EXPECT_EQ(a.visible, b.visible);
  EXPECT_EQ(a.found, b.found);
  EXPECT_EQ(a.descriptor, b.descriptor);
  ASSERT_EQ(a.observations.size(), b.observations.size());
  for (std::size_t i = 0; i < a.observations.size(); ++i) {
    EXPECT_EQ(a.observations[i].feature, b.observations[i].feature);
    const Keyframe& seen_by = nth(saved.keyframes(), b.observations[i].keyframe.value);
    EXPECT_EQ(&saved.keyframes()[a.observations[i].keyframe], &seen_by) << "ids count anew in their order";
  }
}

// All that goes on: every number is the same to the bit.
void expect_equal(const Map& saved, const Map& loaded) {
  ASSERT_EQ(saved.keyframes().size(), loaded.keyframes().size());
  ASSERT_EQ(saved.points().size(), loaded.points().size());
  ASSERT_EQ(saved.lines().size(), loaded.lines().size());
  EXPECT_EQ(saved.pyramid().levels(), loaded.pyramid().levels());
  EXPECT_EQ(saved.pyramid().factor(), loaded.pyramid().factor());
  const std::vector<PartId> parts = saved.parts();
  ASSERT_EQ(parts.size(), loaded.parts().size());
  loaded.keyframes().for_each([&](KeyframeId id, const Keyframe& b) {
    const Keyframe& a = nth(saved.keyframes(), id.value);
    expect_equal(a.T_cw, b.T_cw);
    EXPECT_EQ(a.part, parts[b.part.value]);
    EXPECT_EQ(saved.is_anchor(id_of(saved, id.value)), loaded.is_anchor(id));
    EXPECT_EQ(a.frame->index, b.frame->index);
    EXPECT_EQ(a.frame->timestamp, b.frame->timestamp);
    expect_equal(a.frame->features, b.frame->features);
    expect_equal(*a.line_features, *b.line_features);
    EXPECT_EQ(a.point_trust.weights, b.point_trust.weights);
    EXPECT_EQ(a.line_trust.weights, b.line_trust.weights);
    EXPECT_TRUE(b.point_trust.regions.empty()) << "instance ids mean something within one run only";
  });
  loaded.points().for_each([&](PointId id, const Point& b) {
    const Point& a = nth(saved.points(), id.value);
    EXPECT_EQ(a.position, b.position);
    EXPECT_EQ(a.normal, b.normal);
    EXPECT_EQ(a.min_distance, b.min_distance);
    EXPECT_EQ(a.max_distance, b.max_distance);
    expect_equal_landmarks(saved, a, b);
  });
  loaded.lines().for_each([&](LineId id, const Line& b) {
    const Line& a = nth(saved.lines(), id.value);
    EXPECT_EQ(a.line.moment, b.line.moment);
    EXPECT_EQ(a.line.direction, b.line.direction);
    EXPECT_EQ(a.start, b.start);
    EXPECT_EQ(a.end, b.end);
    EXPECT_EQ(a.contrast, b.contrast);
    expect_equal_landmarks(saved, a, b);
  });
  ASSERT_EQ(saved.loops().size(), loaded.loops().size());
  for (std::size_t i = 0; i < saved.loops().size(); ++i) {
    EXPECT_EQ(saved.loops()[i].a, id_of(saved, loaded.loops()[i].a.value));
    EXPECT_EQ(saved.loops()[i].b, id_of(saved, loaded.loops()[i].b.value));
    expect_equal(saved.loops()[i].T_ab, loaded.loops()[i].T_ab);
  }
}

TEST(MapFile, HoldsEverythingToTheBit) {
  const TemporaryFolder folder;
  const Map map = eventful_map();
  Camera camera = kTestCamera;
  camera.name = "mine", camera.k1 = 0.1, camera.depth_scale = 1000.0;
  save_map(folder / "a.map", map, camera);
  const SavedMap loaded = load_map(folder / "a.map");
  expect_equal(map, loaded.map);
  expect_consistent(loaded.map);
  EXPECT_EQ(loaded.camera.name, "mine");
  EXPECT_EQ(loaded.camera.k1, 0.1);
  EXPECT_EQ(loaded.camera.depth_scale, 1000.0);
  EXPECT_EQ(loaded.camera.width, camera.width);

  save_map(folder / "b.map", loaded.map, loaded.camera);
  EXPECT_EQ(content_of(folder / "a.map"), content_of(folder / "b.map"));
}

TEST(MapFile, ALandmarkMadeWithAKeyframeThatIsGoneIsAsOldAsTheNextOne) {
  Map map(kTestPyramid);
  for (int i = 0; i < 4; ++i) map.add_keyframe(bare_frame(3), camera_at({1.0 * i, 0.0, 0.0}));
  const PointId old = map.add_point({0.0, 0.0, 3.0}, KeyframeId{0}, 0);  // its first keyframe is 3
  for (int i = 4; i < 6; ++i) map.add_keyframe(bare_frame(3), camera_at({1.0 * i, 0.0, 0.0}));
  ASSERT_EQ(map.points()[old].first_keyframe, KeyframeId{3});
  map.remove_keyframe(KeyframeId{1});
  map.remove_keyframe(KeyframeId{3});  // left: 0 2 4 5
  const SavedMap loaded = decode_map(encode_map(map, kTestCamera));
  EXPECT_EQ(loaded.map.points()[PointId{0}].first_keyframe, KeyframeId{2}) << "what was keyframe 4";
}

TEST(MapFile, ALoadedMapGoesOn) {
  SavedMap saved = decode_map(encode_map(eventful_map(), kTestCamera));
  Map& map = saved.map;
  const std::size_t keyframes = map.keyframes().size(), points = map.points().size();
  const KeyframeId id = map.add_keyframe(bare_frame(5), SE3{}, nullptr, {}, {}, map.new_part());
  EXPECT_EQ(id.value, keyframes);
  map.add_point({0.0, 0.0, 2.0}, id, 0);
  map.remove(PointId{0});
  map.fuse(PointId{1}, PointId{2});
  EXPECT_EQ(map.points().size(), points - 1);
  EXPECT_EQ(map.newest_keyframe(), id);
  map.merge_parts(PartId{0}, map.keyframes()[id].part, camera_at({1.0, 2.0, 3.0}));
  expect_consistent(map);
}

TEST(MapFile, AnEmptyMapIsAMapToo) {
  const SavedMap loaded = decode_map(encode_map(Map(kTestPyramid), kTestCamera));
  EXPECT_EQ(loaded.map.keyframes().size(), 0U);
  EXPECT_FALSE(loaded.map.newest_keyframe().valid());
  EXPECT_EQ(loaded.map.new_part(), PartId{0});
}

TEST(MapFile, ANameOfSeveralLinesBecomesOne) {
  Camera camera = kTestCamera;
  camera.name = "my\ncamera\x1b";
  EXPECT_EQ(decode_map(encode_map(Map(kTestPyramid), camera)).camera.name, "my camera ");
}

std::string error_of(const std::filesystem::path& file) {
  const std::string message = message_of<UserError>([&] { (void)load_map(file); });
  EXPECT_THAT(message, HasSubstr(file.string())) << "it names the file";
  EXPECT_THAT(message, ::testing::Not(HasSubstr("\n"))) << "it is one line";
  return message;
}

TEST(MapFile, WhatIsNoMapIsRefusedInOneLineThatNamesTheMend) {
  const TemporaryFolder folder;
  const std::string good = encode_map(eventful_map(), kTestCamera);
  const auto of = [&](const std::string& content) { return error_of(folder.write("x.map", content)); };
  EXPECT_THAT(error_of(folder / "none.map"), HasSubstr("check the path"));
  EXPECT_THAT(error_of(folder.path()), HasSubstr("folder"));
  EXPECT_THAT(of(""), HasSubstr("no map file"));
  EXPECT_THAT(of("\x89PNG\r\n\x1A\n and so on, some more bytes here"), HasSubstr("no map file"));
  EXPECT_THAT(error_of("/dev/zero"), HasSubstr("no map file"));
  EXPECT_THAT(of(good.substr(0, 20)), AllOf(HasSubstr("cut short"), HasSubstr("again")));
  EXPECT_THAT(of(good.substr(0, good.size() - 1)), AllOf(HasSubstr("cut short"), HasSubstr("again")));
  EXPECT_THAT(of(good + "x"), AllOf(HasSubstr("1 bytes follow"), HasSubstr("again")));
  std::string newer = good;
  newer[8] = 2;
  EXPECT_THAT(of(newer), AllOf(HasSubstr("version 2"), HasSubstr("newer ipl_slam")));
  std::string spoiled = good;
  spoiled[good.size() / 2] ^= 1;
  EXPECT_THAT(of(spoiled), AllOf(HasSubstr("checksum of section"), HasSubstr("again")));
  std::string text_mode = good;  // as a transfer that translates line ends leaves it
  text_mode.erase(text_mode.find('\r'), 1);
  EXPECT_THAT(of(text_mode), HasSubstr("no map file"));
}

TEST(MapFile, EveryTruncationAndEveryChangedByteIsRefused) {
  const std::string good = encode_map(eventful_map(), kTestCamera);
  ASSERT_NO_THROW((void)decode_map(good));
  for (std::size_t size = 0; size < good.size(); ++size) {
    ASSERT_THROW((void)decode_map(std::string_view(good).substr(0, size)), FormatError) << size << " bytes";
  }
  std::string spoiled = good;
  for (std::size_t i = 0; i < good.size(); ++i) {
    for (const int change : {0x01, 0x80, 0xFF}) {
      spoiled[i] = static_cast<char>(good[i] ^ change);
      ASSERT_THROW((void)decode_map(spoiled), FormatError) << "byte " << i << " changed by " << change;
    }
    spoiled[i] = good[i];
  }
}

/// A map's file with one of its sections changed, and checksums that are right again.
std::string forged(const std::string& good, std::size_t section,
                   const std::function<void(std::string&)>& change) {
  std::vector<std::string> contents;
  for (const std::string_view content : unpack_sections(map_format(), good)) contents.emplace_back(content);
  change(contents[section]);
  return pack_sections(map_format(), contents);
}

template <class T>
void put(std::string& content, std::size_t at, T value) {
  ByteWriter writer;
  writer.put(value);
  content.replace(at, sizeof(T), writer.bytes());
}

// Places in the content of a section follow docs/formats.md.
TEST(MapFile, WhatContradictsItselfIsRefusedThoughItsChecksumsAreRight) {
  enum { kCamera, kPyramid, kKeyframes, kPoints, kLines, kLoops };
  const std::string good = encode_map(eventful_map(), kTestCamera);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto message = [&](std::size_t section, const std::function<void(std::string&)>& change) {
    return message_of<FormatError>([&] { (void)decode_map(forged(good, section, change)); });
  };
  const auto with = [&](std::size_t section, std::size_t at, auto value) {
    return message(section, [&](std::string& content) { put(content, at, value); });
  };
  const std::size_t name = kTestCamera.name.size();
  EXPECT_THAT(with(kCamera, 0, 0xFFFFFFFFU), HasSubstr("more is announced"));
  EXPECT_THAT(with(kCamera, 4, std::uint8_t{7}), HasSubstr("cannot be shown"));
  EXPECT_THAT(with(kCamera, 4 + name, 0U), HasSubstr("width"));
  EXPECT_THAT(with(kCamera, 4 + name + 8, nan), HasSubstr("number of the camera"));
  EXPECT_THAT(with(kPyramid, 0, std::uint8_t{0}), HasSubstr("pyramid levels"));
  EXPECT_THAT(with(kPyramid, 1, 1.0), HasSubstr("factor"));
  EXPECT_THAT(with(kKeyframes, 0, 0xFFFFFFFFU), HasSubstr("fewer than announced"));
  EXPECT_THAT(with(kKeyframes, 4, 0.9), HasSubstr("rotation that is none"));
  EXPECT_THAT(with(kKeyframes, 4 + 32, nan), HasSubstr("pose"));
  EXPECT_THAT(with(kKeyframes, 4 + 56, 1U), HasSubstr("part that no keyframe started"));
  EXPECT_THAT(with(kKeyframes, 4 + 76, 0xFFFFFFFFU), HasSubstr("keypoints are fewer"));
  EXPECT_THAT(with(kKeyframes, 4 + 80 + 28, std::uint8_t{8}), HasSubstr("level is 8, not from 0 to 7"));
  EXPECT_THAT(with(kPoints, 4, nan), HasSubstr("point's position"));
  EXPECT_THAT(with(kPoints, 28, 1000000U), HasSubstr("first keyframe"));
  EXPECT_THAT(with(kPoints, 32, 0U), HasSubstr("count"));
  EXPECT_THAT(with(kPoints, 44, 1000000U), HasSubstr("observation's keyframe"));
  EXPECT_THAT(with(kPoints, 48, 1000000U), HasSubstr("feature that is not there"));
  EXPECT_THAT(with(kLines, 4 + 24, 0.5), HasSubstr("direction"));
  EXPECT_THAT(with(kLines, 4, 5.0), HasSubstr("line"));
  EXPECT_THAT(with(kLines, 4 + 48, 100.0), HasSubstr("ends beside itself"));
  EXPECT_THAT(with(kLoops, 4, 1U), HasSubstr("with itself"));
  EXPECT_THAT(message(kLoops, [](std::string& content) { content += '\0'; }), HasSubstr("more follows"));
  EXPECT_THAT(message(kLoops, [](std::string& content) { content.pop_back(); }), HasSubstr("again"));
}

// Two keyframes in part 0, one in part 1, of two keypoints each; the second keypoint of the first is removed.
// The file has one point, and `observations` of it.
std::string file_with(const std::vector<std::vector<Observation>>& points) {
  Map map(kTestPyramid);
  map.add_keyframe(bare_frame(2), camera_at({0.0, 0.0, 0.0}), nullptr, {{1.0, 0.0}, {}});
  map.add_keyframe(bare_frame(2), camera_at({1.0, 0.0, 0.0}));
  map.add_keyframe(bare_frame(2), camera_at({1.0, 0.0, 0.0}), nullptr, {}, {}, PartId{1});
  return forged(encode_map(map, kTestCamera), 3, [&](std::string& content) {
    ByteWriter writer;
    writer.put(static_cast<std::uint32_t>(points.size()));
    for (const auto& observations : points) {
      for (const double value : {0.0, 0.0, 2.0}) writer.put(value);
      for (const std::uint32_t value : {0U, 1U, 1U}) writer.put(value);
      writer.put(static_cast<std::uint32_t>(observations.size()));
      for (const Observation& o : observations) writer.put(o.keyframe.value), writer.put(o.feature);
    }
    content = writer.bytes();
  });
}

TEST(MapFile, ObservationsMustAgreeWithEachOther) {
  const KeyframeId a{0}, b{1}, other_part{2};
  const auto message = [](const std::vector<std::vector<Observation>>& points) {
    return message_of<FormatError>([&] { expect_consistent(decode_map(file_with(points)).map); });
  };
  EXPECT_EQ(message({{{a, 0}, {b, 1}}, {{b, 0}}}), "");
  EXPECT_THAT(message({{}, {{a, 0}, {b, 0}}}), HasSubstr("seen by no keyframe"));
  EXPECT_THAT(message({{{b, 0}, {a, 0}}}), HasSubstr("out of order"));
  EXPECT_THAT(message({{{b, 0}, {b, 1}}}), HasSubstr("out of order"));
  EXPECT_THAT(message({{{a, 0}, {b, 0}}, {{b, 0}}}), HasSubstr("two landmarks"));
  EXPECT_THAT(message({{{a, 1}}}), HasSubstr("removed"));
  EXPECT_THAT(message({{{b, 2}}}), HasSubstr("not there"));
  EXPECT_THAT(message({{{a, 0}, {other_part, 0}}}), HasSubstr("two parts"));
}

// A child process saves one map, then the other, over the same file until it is killed.
TEST(MapFile, AKillAtAnyMomentLeavesOneOfTheTwoFiles) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder / "a.map";
  const Map one = eventful_map(20, 300), two = eventful_map(21, 300);
  const std::string first = encode_map(one, kTestCamera), second = encode_map(two, kTestCamera);
  save_map(file, one, kTestCamera);
  Random random(1);
  int firsts = 0;
  for (int kill = 0; kill < 50; ++kill) {
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      while (true) {
        save_map(file, two, kTestCamera);
        save_map(file, one, kTestCamera);
      }
    }
    ::usleep(static_cast<useconds_t>(random.uniform(0.0, 20000.0)));
    ::kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL) << "it was saving until then";
    const std::string left = content_of(file);
    ASSERT_TRUE(left == first || left == second) << left.size() << " bytes";
    ASSERT_NO_THROW((void)load_map(file));
    firsts += left == first ? 1 : 0;
  }
  EXPECT_GT(firsts, 0);
  EXPECT_LT(firsts, 50) << "the kills should have met both";
}

}  // namespace
}  // namespace ipl_slam
