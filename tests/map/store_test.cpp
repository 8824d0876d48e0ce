#include "map/store.hpp"

#include <memory>
#include <set>

#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

using TestStore = Store<PointId, int>;

std::vector<std::pair<std::uint32_t, int>> contents(const TestStore& store) {
  std::vector<std::pair<std::uint32_t, int>> result;
  store.for_each([&](PointId id, int record) { result.emplace_back(id.value, record); });
  return result;
}

TEST(Store, GivesIdsInOrderFromZero) {
  TestStore store;
  EXPECT_EQ(store.insert(10), PointId{0});
  EXPECT_EQ(store.insert(11), PointId{1});
  EXPECT_EQ(store[PointId{0}], 10);
  EXPECT_EQ(store[PointId{1}], 11);
  EXPECT_EQ(store.size(), 2U);
}

TEST(Store, NeverUsesAnIdAgain) {
  TestStore store;
  std::set<PointId> seen;
  for (int i = 0; i < 50; ++i) {
    const PointId id = store.insert(i);
    EXPECT_TRUE(seen.insert(id).second) << "id " << id.value << " was given out twice";
    if (i % 3 == 0) continue;
    store.erase(id);
    EXPECT_FALSE(store.contains(id));
  }
  EXPECT_EQ(store.ids_used(), 50U);
  EXPECT_EQ(store.size(), 17U);
}

TEST(Store, UsesTheMemoryOfErasedRecordsAgain) {
  TestStore store;
  const PointId kept = store.insert(1);
  const PointId gone = store.insert(2);
  const int* place = &store[gone];
  store.erase(gone);
  const PointId next = store.insert(3);
  EXPECT_EQ(&store[next], place);
  EXPECT_NE(next, gone);
  EXPECT_FALSE(store.contains(gone));
  EXPECT_EQ(store[kept], 1);
  EXPECT_EQ(store[next], 3);
}

TEST(Store, LetsGoOfWhatAnErasedRecordHeld) {
  Store<PointId, std::shared_ptr<int>> store;
  const auto held = std::make_shared<int>(7);
  const PointId id = store.insert(held);
  EXPECT_EQ(held.use_count(), 2);
  store.erase(id);
  EXPECT_EQ(held.use_count(), 1);
}

TEST(Store, VisitsTheLivingInOrderOfIdWhereverTheyLie) {
  TestStore store;
  for (int i = 0; i < 5; ++i) store.insert(10 * i);
  store.erase(PointId{3});
  store.erase(PointId{1});
  store.insert(50);  // lies where 1 or 3 lay, in front of 4
  store.insert(60);
  store.insert(70);
  const std::vector<std::pair<std::uint32_t, int>> expected{{0, 0},  {2, 20}, {4, 40},
                                                            {5, 50}, {6, 60}, {7, 70}};
  EXPECT_EQ(contents(store), expected);
}

TEST(Store, DoesNotContainWhatItNeverGaveOut) {
  TestStore store;
  EXPECT_FALSE(store.contains(PointId{0}));
  EXPECT_FALSE(store.contains(PointId{}));
  store.insert(1);
  EXPECT_FALSE(store.contains(PointId{1}));
}

}  // namespace
}  // namespace ipl_slam
