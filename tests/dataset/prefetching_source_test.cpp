#include "dataset/prefetching_source.hpp"

#include <atomic>
#include <stdexcept>

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

/// Gives `count` items, every third one skipped, and counts how many were asked of it.
class CountingSource : public RgbdSource {
 public:
  CountingSource(std::size_t count, std::size_t failing_at, std::atomic<std::size_t>* read)
      : count_(count), failing_at_(failing_at), read_(read) {}

  std::optional<SourceItem> next() override {
    if (position_ == failing_at_) throw std::runtime_error("inner source failed");
    if (position_ == count_) return std::nullopt;
    const std::size_t index = position_++;
    if (read_ != nullptr) ++*read_;
    SourceItem item;
    item.timestamp = static_cast<double>(index);
    if (index % 3 == 2) {
      item.skip_reason = "test";
    } else {
      item.frame = RgbdFrame{index, item.timestamp,
                             cv::Mat(4, 4, CV_8UC1, cv::Scalar(static_cast<double>(index % 256))),
                             cv::Mat(4, 4, CV_16UC1)};
    }
    return item;
  }
  std::size_t size() const override { return count_; }

 private:
  std::size_t count_, failing_at_, position_ = 0;
  std::atomic<std::size_t>* read_;
};

constexpr std::size_t kNever = static_cast<std::size_t>(-1);

std::unique_ptr<RgbdSource> counting(std::size_t count, std::size_t failing_at = kNever,
                                     std::atomic<std::size_t>* read = nullptr) {
  return std::make_unique<CountingSource>(count, failing_at, read);
}

TEST(PrefetchingSource, GivesTheSameItemsInTheSameOrderForAnyCapacity) {
  constexpr std::size_t count = 200;
  for (const std::size_t capacity : {0u, 1u, 4u, 1000u}) {
    PrefetchingSource source(counting(count), capacity);
    EXPECT_EQ(source.size(), count);
    for (std::size_t i = 0; i < count; ++i) {
      const std::optional<SourceItem> item = source.next();
      ASSERT_TRUE(item);
      EXPECT_EQ(item->timestamp, static_cast<double>(i));
      EXPECT_EQ(item->frame.has_value(), i % 3 != 2);
      if (item->frame) {
        EXPECT_EQ(item->frame->color.at<unsigned char>(3, 3), i % 256);
      }
    }
    EXPECT_FALSE(source.next());
    EXPECT_FALSE(source.next()) << "the end stays the end";
  }
}

TEST(PrefetchingSource, ReadsNoFurtherAheadThanItsCapacity) {
  std::atomic<std::size_t> read = 0;
  PrefetchingSource source(counting(1000, kNever, &read), 3);
  for (std::size_t taken = 1; taken <= 20; ++taken) {
    ASSERT_TRUE(source.next());
    EXPECT_LE(read.load(), taken + 3);
  }
}

TEST(PrefetchingSource, StopsWhenAbandonedBeforeTheEnd) {
  std::atomic<std::size_t> read = 0;
  {
    PrefetchingSource source(counting(1000000, kNever, &read), 2);
    ASSERT_TRUE(source.next());
  }
  EXPECT_LE(read.load(), 4u) << "one taken, two waiting, one being read";
  { PrefetchingSource never_asked(counting(10)); }
}

TEST(PrefetchingSource, ThrowsTheInnerSourcesErrorAtItsPlaceAndThenEnds) {
  PrefetchingSource source(counting(10, 2));
  EXPECT_TRUE(source.next());
  EXPECT_TRUE(source.next());
  EXPECT_THROW((void)source.next(), std::runtime_error);
  EXPECT_FALSE(source.next());
}

TEST(PrefetchingSource, OfAnEmptySourceIsEmpty) {
  EXPECT_FALSE(PrefetchingSource(counting(0)).next());
}

}  // namespace
}  // namespace ipl_slam
