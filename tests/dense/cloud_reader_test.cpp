#include <algorithm>
#include <bit>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ipl_slam/error.hpp>

#include "common/byte_stream.hpp"
#include "dataset/temporary_folder.hpp"
#include "dense/cloud_file.hpp"

namespace ipl_slam {
namespace {

using ::testing::HasSubstr;
using testing::TemporaryFolder;

SemanticCloud read(const std::string& bytes, const char* name = "cloud.ply") {
  const TemporaryFolder folder;
  return read_cloud(folder.write(name, bytes));
}

std::string refusal(const std::string& bytes) {
  const TemporaryFolder folder;
  const auto file = folder.write("broken.ply", bytes);
  const std::string message = testing::message_of<UserError>([&] { (void)read_cloud(file); });
  if (!message.empty()) {
    EXPECT_THAT(message, HasSubstr("broken.ply"));
  }
  EXPECT_THAT(message, ::testing::Not(HasSubstr("\n")));
  return message;
}

template <class T>
std::string big_endian(T value) {
  ByteWriter writer;
  writer.put(value);
  std::string bytes = writer.take();
  std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

SemanticCloud some_points() {
  SemanticCloud cloud;
  cloud.points = {{{1.5F, -2.25F, 3.0F}, {0, 0, -1}, {255, 128, 30}, 56, 0.75F},
                  {{-0.1F, 0.2F, 0.3F}, {0.6F, 0.8F, 0}, {200, 100, 50}, CloudPoint::kUnlabelled, 0.0F},
                  {{7, 8, 9}, {0, 0, 0}, {0, 0, 0}, 60, 1.0F}};
  cloud.classes = {{56, "chair", {255, 0, 0}}, {60, "dining table", {0, 255, 0}}};
  return cloud;
}

TEST(ReadCloud, GivesBackWhatWasWritten) {
  const SemanticCloud cloud = some_points();
  for (const std::string& bytes : {cloud_ply(cloud), cloud_pcd(cloud)}) {
    const SemanticCloud again = read(bytes);
    EXPECT_EQ(again.points, cloud.points);
    EXPECT_EQ(again.classes, cloud.classes);
  }
}

TEST(ReadCloud, TakesAnEmptyCloud) {
  EXPECT_TRUE(read(cloud_ply({})).points.empty());
  EXPECT_TRUE(read(cloud_pcd({})).points.empty());
}

TEST(ReadCloud, TakesTextAsMeshLabWritesIt) {
  const SemanticCloud cloud = read(
      "ply\r\nformat ascii 1.0\r\ncomment VCGLIB generated\r\nelement vertex 2\r\n"
      "property float x\r\nproperty float y\r\nproperty float z\r\nproperty uchar red\r\nproperty uchar "
      "green\r\n"
      "property uchar blue\r\nproperty uchar alpha\r\nelement face 1\r\nproperty list uchar int "
      "vertex_indices\r\n"
      "end_header\r\n1 2 3 10 20 30 255 \r\n-1e-1 2.5 3 40 50 60 255 \r\n3 0 1 0\r\n");
  ASSERT_EQ(cloud.points.size(), 2U);
  EXPECT_EQ(cloud.points[0].position, Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ(cloud.points[0].color, (Rgb{10, 20, 30}));
  EXPECT_EQ(cloud.points[1].position, Eigen::Vector3f(-0.1F, 2.5F, 3));
  EXPECT_TRUE(cloud.points[0].normal.isZero()) << "there is none";
  EXPECT_EQ(cloud.points[0].label, CloudPoint::kUnlabelled);
  EXPECT_TRUE(cloud.classes.empty());
}

TEST(ReadCloud, TakesDoublesWithNormalsAsOpen3dWritesThem) {
  ByteWriter out;
  out.put(
      "ply\nformat binary_little_endian 1.0\ncomment Created by Open3D\nelement vertex 1\n"
      "property double x\nproperty double y\nproperty double z\n"
      "property double nx\nproperty double ny\nproperty double nz\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n");
  for (const double v : {1.0, 2.0, 3.0, 0.0, 2.0, 0.0}) out.put(v);
  for (const unsigned char c : {1, 2, 3}) out.put(c);
  const SemanticCloud cloud = read(out.bytes());
  ASSERT_EQ(cloud.points.size(), 1U);
  EXPECT_EQ(cloud.points[0].position, Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ(cloud.points[0].normal, Eigen::Vector3f::UnitY()) << "made a unit vector";
  EXPECT_EQ(cloud.points[0].color, (Rgb{1, 2, 3}));
}

TEST(ReadCloud, TakesScalarFieldsAsCloudCompareWritesThem) {
  const SemanticCloud cloud = read(
      "ply\nformat ascii 1.0\ncomment label 3 car 1 2 3\nelement vertex 2\nproperty float x\nproperty float "
      "y\n"
      "property float z\nproperty float scalar_label\nproperty float scalar_confidence\nend_header\n"
      "0 0 0 3.000000 0.5\n1 1 1 -1.0 0\n");
  ASSERT_EQ(cloud.points.size(), 2U);
  EXPECT_EQ(cloud.points[0].label, 3);
  EXPECT_EQ(cloud.points[0].confidence, 0.5F);
  EXPECT_EQ(cloud.points[1].label, CloudPoint::kUnlabelled);
  EXPECT_EQ(cloud.classes, (std::vector<CloudClass>{{3, "car", {1, 2, 3}}}));
}

TEST(ReadCloud, TakesBigEndianAnyOrderAndSkipsLists) {
  // A camera element and a list per point stand in the way.
  std::string bytes =
      "ply\nformat binary_big_endian 1.0\nelement camera 2\nproperty float focal\nproperty list uint8 int16 "
      "ids\n"
      "element vertex 2\nproperty uchar b\nproperty double z\nproperty list ushort float extra\nproperty "
      "int16 x\n"
      "property float y\nproperty uchar g\nproperty uchar r\nend_header\n";
  for (int camera = 0; camera < 2; ++camera) {
    bytes += big_endian(1.0F) + '\x02' + big_endian<std::uint16_t>(1) + big_endian<std::uint16_t>(2);
  }
  for (std::uint16_t i = 0; i < 2; ++i) {
    bytes += '\x05';
    bytes += big_endian(3.5 + i) + big_endian(i);  // z, length
    for (int k = 0; k < i; ++k) bytes += big_endian(99.0F);
    bytes += big_endian<std::uint16_t>(0xFFFF) + big_endian(2.0F) + "\x06\x07";
  }
  const SemanticCloud cloud = read(bytes);
  ASSERT_EQ(cloud.points.size(), 2U);
  EXPECT_EQ(cloud.points[0].position, Eigen::Vector3f(-1, 2, 3.5F));
  EXPECT_EQ(cloud.points[1].position, Eigen::Vector3f(-1, 2, 4.5F));
  EXPECT_EQ(cloud.points[1].color, (Rgb{7, 6, 5}));
}

TEST(ReadCloud, TakesColoursAsFractions) {
  const SemanticCloud cloud = read(
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
      "property float diffuse_red\nproperty float diffuse_green\nproperty float diffuse_blue\nend_header\n"
      "0 0 0 1.0 0.5 0\n0 0 1 7 -1 nan\n");
  ASSERT_EQ(cloud.points.size(), 2U);
  EXPECT_EQ(cloud.points[0].color, (Rgb{255, 128, 0}));
  EXPECT_EQ(cloud.points[1].color, (Rgb{255, 0, 0}));
}

TEST(ReadCloud, LeavesOutPointsThatAreNowhere) {
  const SemanticCloud cloud = read(
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double "
      "z\nend_header\n"
      "nan 0 0\n0 inf 0\n1e300 0 0\n1 2 3\n");
  ASSERT_EQ(cloud.points.size(), 1U);
  EXPECT_EQ(cloud.points[0].position, Eigen::Vector3f(1, 2, 3));
}

TEST(ReadCloud, NamesClassesWithoutALegend) {
  const SemanticCloud cloud = read(
      "ply\nformat ascii 1.0\ncomment label 1 unused 0 0 0\nelement vertex 1\nproperty float x\nproperty "
      "float y\n"
      "property float z\nproperty uint label\nend_header\n0 0 0 7\n");
  ASSERT_EQ(cloud.classes.size(), 1U);
  EXPECT_EQ(cloud.classes[0].label, 7);
  EXPECT_EQ(cloud.classes[0].name, "class 7");
}

TEST(ReadCloud, TakesPcdTextWithAPackedColour) {
  // The first as PCL writes it now, the second as a float with the bits 0x00FF8000.
  const std::string head =
      "# .PCD v.7 - Point Cloud Data file format\nVERSION .7\nFIELDS x y z _ rgb\nSIZE 4 4 4 1 4\n";
  const std::string tail =
      "COUNT 1 1 1 2 1\nWIDTH 1\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 1\nDATA ascii\n";
  const Rgb expected{255, 128, 0};
  EXPECT_EQ(read(head + "TYPE F F F U U\n" + tail + "1 2 3 0 0 16744448\n").points.at(0).color, expected);
  EXPECT_EQ(read(head + "TYPE F F F U F\n" + tail + "1 2 3 0 0 2.3463969e-38\n").points.at(0).color,
            expected);
  EXPECT_EQ(std::bit_cast<float>(0x00FF8000U), 2.3463969e-38F) << "the number that stands above";
}

TEST(ReadCloud, TakesAPackedColourWhoseFloatIsNoNumber) {
  ByteWriter out;
  out.put("VERSION 0.7\nFIELDS rgba x y z\nSIZE 4 4 4 4\nTYPE F F F F\nWIDTH 1\nHEIGHT 1\nDATA binary\n");
  out.put(std::uint32_t{0xFF804020});  // a signalling NaN
  for (const float v : {1.0F, 2.0F, 3.0F}) out.put(v);
  EXPECT_EQ(read(out.bytes()).points.at(0).color, (Rgb{0x80, 0x40, 0x20}));
}

TEST(ReadCloud, SaysHowToUnpackACompressedPcd) {
  EXPECT_THAT(
      refusal(
          "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\n"
          "POINTS 1\nDATA binary_compressed\n12345678"),
      HasSubstr("pcl_convert_pcd_ascii_binary"));
}

TEST(ReadCloud, NoticesEveryWayInWhichAFileCanBeCutShort) {
  for (const std::string& whole : {cloud_ply(some_points()), cloud_pcd(some_points())}) {
    for (std::size_t size = 0; size < whole.size(); size += 5) {
      EXPECT_NE(refusal(whole.substr(0, size)), "") << "cut to " << size << " bytes";
    }
  }
}

TEST(ReadCloud, BelievesNoCount) {
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n", end = "end_header\n";
  const std::string ply = "ply\nformat binary_little_endian 1.0\n";
  EXPECT_THAT(refusal(ply + "element vertex 900000000000000\n" + xyz + end + "abc"), HasSubstr("cut short"));
  EXPECT_THAT(refusal(ply + "element vertex 99999999999999999999\n" + xyz + end), HasSubstr("vertex 9999"));
  EXPECT_THAT(refusal(ply + "element vertex -1\n" + xyz + end), HasSubstr("vertex -1"));
  EXPECT_THAT(refusal(ply + "element v 1\nproperty list uint double a\nelement vertex 0\n" + xyz + end +
                      "\xff\xff\xff\xff"),
              HasSubstr("cut short"));
  EXPECT_THAT(
      refusal(ply + "element v 1\nproperty list char double a\nelement vertex 0\n" + xyz + end + "\xff"),
      HasSubstr("cut short"));
  // Rows of nothing take no time.
  EXPECT_TRUE(read(ply + "element v 900000000000000\nelement vertex 0\n" + xyz + end).points.empty());
}

TEST(ReadCloud, RefusesWhatIsNoCloud) {
  EXPECT_THAT(refusal(""), HasSubstr("is no cloud"));
  EXPECT_THAT(refusal("dear diary"), HasSubstr("is no cloud"));
  EXPECT_THAT(refusal("plywood\n"), HasSubstr("no PLY"));
  EXPECT_THAT(refusal("ply\nend_header\n"), HasSubstr("format"));
  EXPECT_THAT(refusal("ply\nformat ascii 1.0\nelement face 0\nend_header\n"), HasSubstr("no points"));
  EXPECT_THAT(refusal("ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nend_header\n"),
              HasSubstr("x, y or z"));
  EXPECT_THAT(refusal("ply\nformat ascii 1.0\nproperty float x\nend_header\n"),
              HasSubstr("property float x"));
  EXPECT_THAT(refusal("ply\nformat ascii 1.0\nelement vertex 1\nproperty text x\nend_header\n"),
              HasSubstr("text x"));
  EXPECT_THAT(
      refusal(
          "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
          "end_header\n1 2 three\n"),
      HasSubstr("'three'"));
  EXPECT_THAT(refusal("VERSION 0.7\nFIELDS x y z\nSIZE 4 4\nTYPE F F F\nWIDTH 0\nHEIGHT 1\nDATA ascii\n"),
              HasSubstr("SIZE"));
  EXPECT_THAT(refusal("VERSION 0.7\nSIZE 4 4\nTYPE F F F\nWIDTH 0\nHEIGHT 1\nDATA ascii\n"),
              HasSubstr("FIELDS"));
  EXPECT_THAT(testing::message_of<UserError>([] { (void)read_cloud("nowhere.ply"); }),
              HasSubstr("nowhere.ply"));
}

}  // namespace
}  // namespace ipl_slam
