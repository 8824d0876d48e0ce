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
    write.threads = 1;  // ThreadSanitizer cannot see into OpenCV's image writers
    write_sequence(source, folder_ / "room", write);
    for (int i = 0; i < kFrames; ++i) {
      SyntheticFrame frame = source.render(static_cast<std::size_t>(i));
      for (const SyntheticObject& object : source.objects()) {
        // As many pixels as the masks segmenter takes for an instance.
        if (object.class_name == "person" &&
            cv::countNonZero(frame.mask == object.id) >= MaskFolderOptions().min_area) {
          people_.insert(object.id);
        }
      }
      frames_.push_back(std::move(frame.rgbd));
    }
  }

  [[nodiscard]] const std::vector<RgbdFrame>& frames() const { return frames_; }
  /// How many of them come into the picture at all, by their true masks.
  [[nodiscard]] std::size_t people_seen() const { return people_.size(); }
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
  std::set<int> people_;
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
  EXPECT_EQ(ids_of(result, "person").size(), walkers().people_seen());
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

// By what was found until the end, masks of the frames before a verdict included.
TEST(LockstepInstances, TellThoseWhoWalkFromWhatStandsStill) {
  Pipeline pipeline(small_camera(), walkers().with_masks());
  const SequenceRun result = run(pipeline);
  std::set<std::string> moving, still;
  for (const FrameRecord& f : result.frames) {
    for (const InstanceRecord& i : f.result.instances) {
      const bool dynamic = pipeline.instances().dynamic().contains(i.id, f.index);
      (dynamic ? moving : still).insert(i.class_name);
    }
  }
  EXPECT_EQ(moving, std::set<std::string>{"person"});
  EXPECT_TRUE(still.contains("chair"));
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
