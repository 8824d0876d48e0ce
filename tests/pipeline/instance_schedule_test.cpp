#include "pipeline/instance_schedule.hpp"

#include <set>

#include <gtest/gtest.h>

#include "dataset/synthetic/write_sequence.hpp"
#include "dataset/temporary_folder.hpp"
#include "pipeline/instance_log.hpp"
#include "pipeline/pipeline.hpp"
#include "pipeline/sequence_run.hpp"
#include "support/rendered_sequence.hpp"

namespace ipl_slam {
namespace {

using testing::KeptFrames;
using testing::small_camera;
using testing::TemporaryFolder;

/// Two people in a small room, with their true masks on disk.
class Walkers {
 public:
  static constexpr int kFrames = 40;

  Walkers() {
    SyntheticOptions options = testing::small_room(kFrames, "xyz");
    options.people = 2;
    const SyntheticSource source(options, 2);
    SequenceWriteOptions write;
    write.threads = 2;
    write_sequence(source, folder_ / "room", write);
    frames_ = testing::render_all(options);
  }

  [[nodiscard]] const std::vector<RgbdFrame>& frames() const { return frames_; }
  [[nodiscard]] Config with_masks() const {
    Config config;
    config.segmentation.segmenter = "masks";
    // objects.json, which says what the ids are, lies beside the masks' index.
    config.segmentation.masks.folder = (folder_ / "room").string();
    return config;
  }

 private:
  TemporaryFolder folder_;
  std::vector<RgbdFrame> frames_;
};

const Walkers& walkers() {
  static const Walkers once;
  return once;
}

SequenceRun run(Pipeline& pipeline) {
  KeptFrames source(walkers().frames());
  return run_sequence(source, pipeline);
}

std::set<InstanceId> ids_of(const SequenceRun& run, const std::string& class_name) {
  std::set<InstanceId> ids;
  for (const FrameRecord& f : run.frames) {
    for (const InstanceRecord& i : f.result.instances) {
      if (i.class_name == class_name) ids.insert(i.id);
    }
  }
  return ids;
}

TEST(LockstepInstances, SeesEveryFrameAndKeepsOneIdPerPerson) {
  Pipeline pipeline(small_camera(), walkers().with_masks());
  const SequenceRun result = run(pipeline);
  for (const FrameRecord& f : result.frames) EXPECT_EQ(f.result.mask_age, 0);
  const std::set<InstanceId> people = ids_of(result, "person");
  EXPECT_GE(people.size(), 1U);
  EXPECT_LE(people.size(), 2U);
  EXPECT_EQ(pipeline.instances().times().segmentation.size(), result.frames.size());
}

TEST(LockstepInstances, AreCarriedOverTheFramesThatAreNotSegmented) {
  Config config = walkers().with_masks();
  config.segmentation.every = 3;
  Pipeline pipeline(small_camera(), config);
  const SequenceRun result = run(pipeline);
  std::size_t carried = 0;
  for (const FrameRecord& f : result.frames) {
    EXPECT_EQ(f.result.mask_age, static_cast<int>(f.index % 3));
    for (const InstanceRecord& i : f.result.instances) carried += i.frames_carried > 0 ? 1 : 0;
  }
  EXPECT_GT(carried, 0U);
  EXPECT_EQ(pipeline.instances().times().segmentation.size(), (result.frames.size() + 2) / 3);
}

TEST(LockstepInstances, GiveTheSameLogTwice) {
  std::string logs[2];
  for (std::string& log : logs) {
    Config config;  // geometric, which has most to decide
    config.segmentation.segmenter = "geometric";
    Pipeline pipeline(small_camera(), config);
    const SequenceRun result = run(pipeline);
    log = instances_jsonl(result, pipeline.instances().dynamic());
  }
  EXPECT_NE(logs[0].find("\"id\""), std::string::npos) << "nobody was seen, so nothing is compared";
  EXPECT_EQ(logs[0], logs[1]);
}

TEST(RealtimeInstances, NeverKeepAFrameWaitingForMasksAndSayHowOldTheyAre) {
  Config config = walkers().with_masks();
  config.schedule.mode = "realtime";
  Pipeline pipeline(small_camera(), config);
  const SequenceRun result = run(pipeline);
  ASSERT_EQ(result.frames.size(), static_cast<std::size_t>(Walkers::kFrames));
  int last_picture = -1;
  std::size_t with_masks = 0;
  for (const FrameRecord& f : result.frames) {
    if (f.result.mask_age < 0) {
      EXPECT_EQ(last_picture, -1) << "masks were there before and are gone";
      EXPECT_TRUE(f.result.instances.empty());
      continue;
    }
    ++with_masks;
    const int picture = static_cast<int>(f.index) - f.result.mask_age;
    EXPECT_GE(picture, last_picture) << "newer masks were there already";
    last_picture = picture;
    for (const InstanceRecord& i : f.result.instances) EXPECT_GE(i.frames_carried, f.result.mask_age);
  }
  EXPECT_GT(with_masks, 0U);
  EXPECT_GT(pipeline.instances().times().contours.size(), 0U);
}

TEST(RealtimeInstances, CanBeAbandonedAtAnyMoment) {
  for (const std::size_t frames : {std::size_t{1}, std::size_t{3}, std::size_t{8}}) {
    Config config;
    config.schedule.mode = "realtime";
    config.segmentation.segmenter = "geometric";
    Pipeline pipeline(small_camera(), config);
    for (std::size_t i = 0; i < frames; ++i) (void)pipeline.process(walkers().frames()[i]);
  }
}

TEST(NoInstances, AreSeenWithoutASegmenter) {
  Config config;
  config.segmentation.segmenter = "none";
  Pipeline pipeline(small_camera(), config);
  const SequenceRun result = run(pipeline);
  for (const FrameRecord& f : result.frames) {
    EXPECT_EQ(f.result.mask_age, -1);
    EXPECT_TRUE(f.result.instances.empty());
  }
}

}  // namespace
}  // namespace ipl_slam
