#include "dataset/spliced_source.hpp"

#include <memory>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace ipl_slam {
namespace {

// Frames 0.1 s apart whose grey value is their number; every fifth item is a broken frame.
class Counting : public RgbdSource {
 public:
  Counting(std::size_t size, int offset) : size_(size), offset_(offset) {}
  [[nodiscard]] std::size_t size() const override { return size_; }
  [[nodiscard]] std::optional<SourceItem> next() override {
    if (position_ == size_) return std::nullopt;
    const std::size_t i = position_++;
    SourceItem item;
    item.timestamp = 100.0 + 0.1 * static_cast<double>(i);
    if (i % 5 == 4) {
      item.skip_reason = "broken";
      return item;
    }
    item.frame.emplace();
    item.frame->index = i;
    item.frame->timestamp = item.timestamp;
    item.frame->color = cv::Mat(4, 6, CV_8UC3, cv::Scalar::all(offset_ + static_cast<double>(i)));
    item.frame->depth = cv::Mat(4, 6, CV_16UC1, cv::Scalar::all(1000.0));
    return item;
  }

 private:
  std::size_t size_, position_ = 0;
  int offset_;
};

int grey(const SourceItem& item) {
  return item.frame->color.at<cv::Vec3b>(0, 0)[0];
}

std::vector<SourceItem> all_of(SplicedSource& source) {
  std::vector<SourceItem> items;
  while (auto item = source.next()) items.push_back(std::move(*item));
  return items;
}

TEST(SplicedSource, PlaysItsCutsOneAfterTheOtherAndSaysWhereEachFrameComesFrom) {
  Counting here(20, 0), there(20, 100);
  SplicedSource source({&here, &there}, {{0, 10, 12}, {1, 5, 6}, {0, 0, 1}}, 0.1);
  const std::vector<SourceItem> items = all_of(source);
  ASSERT_EQ(items.size(), 7U);
  ASSERT_EQ(source.size(), 7U);
  const int expected[] = {10, 11, 12, 105, 106, 0, 1};
  for (std::size_t i = 0; i < 7; ++i) {
    EXPECT_EQ(grey(items[i]), expected[i]);
    EXPECT_EQ(items[i].frame->index, i);
    EXPECT_EQ(static_cast<int>(source.origin(i).source * 100 + source.origin(i).index), expected[i]);
    EXPECT_EQ(source.timestamp(i), items[i].timestamp);
  }
}

TEST(SplicedSource, TimeRunsOnAcrossCuts) {
  Counting here(20, 0);
  SplicedSource source({&here}, {{0, 10, 13}, {0, 2, 3}}, 0.25);
  const std::vector<SourceItem> items = all_of(source);
  ASSERT_EQ(items.size(), 6U);
  EXPECT_NEAR(items[0].timestamp, 101.0, 1e-9);  // as in the source
  for (std::size_t i = 1; i < 6; ++i) {
    EXPECT_NEAR(items[i].timestamp - items[i - 1].timestamp, i == 4 ? 0.25 : 0.1, 1e-9);
    EXPECT_EQ(items[i].frame->timestamp, items[i].timestamp);
  }
}

TEST(SplicedSource, ACoveredLensSeesNothingAndLeavesTheOriginalsAlone) {
  Counting here(20, 1);
  SplicedSource source({&here}, {{0, 0, 1}, {0, 0, 1, true}, {0, 0, 1}}, 0.1);
  const std::vector<SourceItem> items = all_of(source);
  for (const std::size_t i : {2, 3}) {
    EXPECT_EQ(cv::norm(items[i].frame->color, cv::NORM_INF), 0.0);
    EXPECT_EQ(cv::norm(items[i].frame->depth, cv::NORM_INF), 0.0);
    EXPECT_TRUE(source.origin(i).covered);
  }
  for (const std::size_t i : {0, 1, 4, 5}) {
    EXPECT_EQ(grey(items[i]), 1 + static_cast<int>(i % 2));
    EXPECT_EQ(items[i].frame->depth.at<std::uint16_t>(0, 0), 1000);
  }
}

TEST(SplicedSource, BrokenFramesStayBroken) {
  Counting here(20, 0);
  SplicedSource source({&here}, {{0, 3, 5, true}}, 0.1);
  const std::vector<SourceItem> items = all_of(source);
  ASSERT_EQ(items.size(), 3U);
  EXPECT_TRUE(items[0].frame);
  EXPECT_FALSE(items[1].frame);
  EXPECT_EQ(items[1].skip_reason, "broken");
  EXPECT_NEAR(items[1].timestamp, 100.4, 1e-9);
  EXPECT_EQ(items[2].frame->index, 2U);
}

TEST(SplicedSource, RefusesCutsThatCannotBePlayed) {
  const auto make = [](const std::vector<SplicedSource::Cut>& cuts, double step = 0.1) {
    Counting here(20, 0);
    SplicedSource source({&here}, cuts, step);
  };
  EXPECT_NO_THROW(make({{0, 0, 19}}));
  EXPECT_THROW(make({}), std::invalid_argument);
  EXPECT_THROW(make({{0, 0, 20}}), std::invalid_argument);
  EXPECT_THROW(make({{0, 3, 2}}), std::invalid_argument);
  EXPECT_THROW(make({{1, 0, 1}}), std::invalid_argument);
  EXPECT_THROW(make({{0, 0, 1}}, 0.0), std::invalid_argument);
}

}  // namespace
}  // namespace ipl_slam
