#include "dense/view_store.hpp"

#include <stdexcept>

#include <gtest/gtest.h>

#include "dense/made_view.hpp"

namespace ipl_slam {
namespace {

using testing::equal;
using testing::made_view;

constexpr KeyframeId kNine{9}, kTwo{2};
const cv::Size kSize(64, 48);

TEST(ViewStore, KeepsDepthLabelsAndInstancesAsTheyAreAndColoursClosely) {
  ViewStore store(kSize);
  store.add(kNine, made_view(kSize, 0));
  store.add(kTwo, made_view(kSize, 1));
  EXPECT_EQ(store.ids(), (std::vector<KeyframeId>{kTwo, kNine}));
  EXPECT_TRUE(store.holds(kTwo));
  EXPECT_FALSE(store.holds(KeyframeId{3}));
  for (const auto& [id, view] :
       {std::pair(kNine, made_view(kSize, 0)), std::pair(kTwo, made_view(kSize, 1))}) {
    EXPECT_EQ(store.timestamp(id), view.timestamp);
    EXPECT_EQ(store.instances(id), view.instances);
    EXPECT_TRUE(equal(store.depth(id), view.depth));
    EXPECT_TRUE(equal(store.labels(id), view.labels));
    const cv::Mat color = store.color(id);
    ASSERT_EQ(color.size(), kSize);
    ASSERT_EQ(color.type(), CV_8UC3);
    // A smooth picture; JPEG halves the resolution of the colours, which rise by 4 in two pixels.
    EXPECT_LT(cv::norm(color, view.color, cv::NORM_L1) / static_cast<double>(3 * kSize.area()), 3.0);
  }
}

TEST(ViewStore, TakesColourThatIsPackedAlreadyByteByByte) {
  ViewStore store(kSize), copy(kSize);
  store.add(kNine, made_view(kSize, 0));
  copy.add(kTwo, made_view(kSize, 0), store.color_jpeg(kNine));
  EXPECT_EQ(copy.color_jpeg(kTwo), store.color_jpeg(kNine));
  EXPECT_EQ(copy.bytes(), store.bytes());
  EXPECT_LT(store.bytes(), static_cast<std::size_t>(kSize.area()) * 6) << "packed";
}

TEST(ViewStore, RefusesWhatDoesNotFit) {
  ViewStore store(kSize);
  store.add(kNine, made_view(kSize, 0));
  EXPECT_THROW(store.add(kNine, made_view(kSize, 1)), std::invalid_argument) << "there already";
  EXPECT_THROW(store.add(kTwo, made_view({48, 64}, 1)), std::invalid_argument);
  EXPECT_FALSE(store.holds(kTwo));
  EXPECT_THROW((void)store.depth(kTwo), std::invalid_argument);
}

}  // namespace
}  // namespace ipl_slam
