#include "dense/cloud_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "written_files.hpp"

namespace ipl_slam {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using testing::number_at;
using testing::parse_written_pcd;
using testing::parse_written_ply;

SemanticCloud two_points() {
  SemanticCloud cloud;
  cloud.points = {{{1.5F, -2.25F, 3.0F}, {0, 0, -1}, {10, 20, 30}, 56, 0.75F},
                  {{-0.1F, 0.2F, 0.3F}, {0.6F, 0.8F, 0}, {200, 100, 50}, CloudPoint::kUnlabelled, 0.0F}};
  cloud.classes = {{56, "chair", {255, 0, 1}}};
  return cloud;
}

TEST(CloudPly, HoldsEveryPointAsItIs) {
  const auto ply = parse_written_ply(cloud_ply(two_points()));
  auto columns = ply.vertices;
  EXPECT_THAT(columns["x"], ElementsAre(1.5, -0.1F));
  EXPECT_THAT(columns["y"], ElementsAre(-2.25, 0.2F));
  EXPECT_THAT(columns["z"], ElementsAre(3.0, 0.3F));
  EXPECT_THAT(columns["nx"], ElementsAre(0, 0.6F));
  EXPECT_THAT(columns["ny"], ElementsAre(0, 0.8F));
  EXPECT_THAT(columns["nz"], ElementsAre(-1, 0));
  EXPECT_THAT(columns["red"], ElementsAre(10, 200));
  EXPECT_THAT(columns["green"], ElementsAre(20, 100));
  EXPECT_THAT(columns["blue"], ElementsAre(30, 50));
  EXPECT_THAT(columns["label"], ElementsAre(56, -1));
  EXPECT_THAT(columns["confidence"], ElementsAre(0.75, 0));
  EXPECT_EQ(columns.size(), 11U);
}

TEST(CloudPly, SaysWhoMadeItAndWhatTheLabelsMean) {
  const auto ply = parse_written_ply(cloud_ply(two_points()));
  EXPECT_THAT(ply.comments, Contains("label 56 chair 255 0 1"));
  EXPECT_THAT(ply.comments,
              Contains(::testing::AllOf(::testing::HasSubstr("ipl_slam"), ::testing::HasSubstr("metres"),
                                        ::testing::HasSubstr("world frame"))));
}

TEST(CloudPly, GivesLabelledPointsTheColourOfTheirClassWhereAskedTo) {
  auto columns = parse_written_ply(cloud_ply(two_points(), CloudColors::kLabels)).vertices;
  EXPECT_THAT(columns["red"], ElementsAre(255, 200));
  EXPECT_THAT(columns["green"], ElementsAre(0, 100));
  EXPECT_THAT(columns["blue"], ElementsAre(1, 50));
}

TEST(CloudPly, IsNotBrokenByANameOfSeveralLines) {
  SemanticCloud cloud = two_points();
  cloud.classes[0].name = "chair\nend_header\r\tx ";
  EXPECT_THAT(parse_written_ply(cloud_ply(cloud)).comments, Contains("label 56 chair end_header x 255 0 1"));
}

TEST(CloudPcd, HoldsEveryPointWithThePackedColourOfPcl) {
  const auto pcd = parse_written_pcd(cloud_pcd(two_points()));
  auto head = pcd.head;
  EXPECT_EQ(head["VERSION"], "0.7");
  EXPECT_EQ(head["FIELDS"], "x y z rgb normal_x normal_y normal_z label confidence");
  EXPECT_EQ(head["SIZE"], "4 4 4 4 4 4 4 4 4");
  EXPECT_EQ(head["TYPE"], "F F F F F F F I F");
  EXPECT_EQ(head["WIDTH"], "2");
  EXPECT_EQ(head["HEIGHT"], "1");
  EXPECT_EQ(head["POINTS"], "2");
  EXPECT_THAT(pcd.comments, Contains("label 56 chair 255 0 1"));
  ASSERT_EQ(pcd.data.size(), 2U * 9 * 4);
  EXPECT_EQ(number_at<float>(pcd.data, 0), 1.5F);
  EXPECT_EQ(number_at<std::uint32_t>(pcd.data, 12), 0x000A141EU);
  EXPECT_EQ(number_at<float>(pcd.data, 24), -1.0F);
  EXPECT_EQ(number_at<std::int32_t>(pcd.data, 28), 56);
  EXPECT_EQ(number_at<float>(pcd.data, 32), 0.75F);
  EXPECT_EQ(number_at<std::int32_t>(pcd.data, 36 + 28), -1);

  const auto labels = parse_written_pcd(cloud_pcd(two_points(), CloudColors::kLabels));
  EXPECT_EQ(number_at<std::uint32_t>(labels.data, 12), 0x00FF0001U);
}

TEST(MeshPly, HoldsVerticesAndTriangles) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.colors = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {255, 254, 253}};
  mesh.triangles = {{0, 1, 2}, {3, 2, 1}};
  const auto ply = parse_written_ply(mesh_ply(mesh));
  auto columns = ply.vertices;
  EXPECT_THAT(columns["z"], ElementsAre(0, 0, 0, 1));
  EXPECT_THAT(columns["red"], ElementsAre(1, 4, 7, 255));
  EXPECT_THAT(columns["blue"], ElementsAre(3, 6, 9, 253));
  EXPECT_THAT(ply.faces, ElementsAre(ElementsAre(0, 1, 2), ElementsAre(3, 2, 1)));

  mesh.colors.pop_back();
  EXPECT_THROW((void)mesh_ply(mesh), std::invalid_argument);
}

TEST(ObjectsJson, ListsObjectsAndTheLegend) {
  CloudObject object;
  object.label = 62;
  object.class_name = "tv";
  object.confidence = 0.123456F;
  object.low = {-1.0F, 0.1F, 2.0F};
  object.high = {0.0F, 0.5F, 2.25F};
  object.centre = {-0.5F, 0.3F, 2.1F};
  object.views = 7;
  object.points = 1234;
  const auto json = objects_json({object}, {{62, "tv", {0, 128, 255}}});
  EXPECT_EQ(json.dump(), R"({"legend":[{"label":62,"class":"tv","color":[0,128,255]}],)"
                         R"("objects":[{"label":62,"class":"tv","confidence":0.1235,"centre":[-0.5,0.3,2.1],)"
                         R"("low":[-1.0,0.1,2.0],"high":[0.0,0.5,2.25],"views":7,"points":1234}]})");
  EXPECT_EQ(objects_json({}, {}).dump(), R"({"legend":[],"objects":[]})");
}

}  // namespace
}  // namespace ipl_slam
