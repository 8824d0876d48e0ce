#include <algorithm>
#include <memory>
#include <numeric>

#include <fmt/format.h>
#include <opencv2/core/utility.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include <ipl_slam/error.hpp>

#include "bench_cloud.hpp"
#include "bench_places.hpp"
#include "bench_tum.hpp"
#include "common/stopwatch.hpp"
#include "dataset/tum_dataset.hpp"
#include "pipeline/pipeline.hpp"
#include "sequence_options.hpp"
#include "verbs.hpp"

namespace ipl_slam::cli {
namespace {

struct Samples {
  std::string name;
  std::vector<double> milliseconds;

  [[nodiscard]] double mean() const {
    return std::accumulate(milliseconds.begin(), milliseconds.end(), 0.0) /
           static_cast<double>(milliseconds.size());
  }
  [[nodiscard]] double median() const {
    std::vector<double> sorted = milliseconds;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                     sorted.end());
    return sorted[sorted.size() / 2];
  }
};

// Times tracking, grey image to pose, beside OpenCV's ORB on the same frames. The two take turns, so that
// whatever else the machine does hits both alike.
void bench_tracking(const SequenceOptions& options) {
  cv::setNumThreads(1);
  Config config = options.load_config();
  config.schedule.mode = "lockstep";
  config.schedule.threads = 1;
  config.segmentation.segmenter = "none";
  config.dense.enabled = false;
  const Camera camera = options.load_camera();
  TumDataset source(options.folder, camera, options.dataset_options());
  Pipeline pipeline(camera, config);
  const cv::Ptr<cv::ORB> reference =
      cv::ORB::create(config.orb.features, static_cast<float>(config.orb.scale_factor), config.orb.levels);

  Samples features{"features", {}}, tracking{"tracking", {}}, frame{"frame = features + tracking", {}},
      orb{"cv::ORB detectAndCompute", {}};
  while (auto item = source.next()) {
    if (!item->frame) continue;
    cv::Mat gray;
    item->frame->color.channels() == 3 ? cv::cvtColor(item->frame->color, gray, cv::COLOR_BGR2GRAY)
                                       : void(gray = item->frame->color);
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
    const Stopwatch stopwatch;
    reference->detectAndCompute(gray, cv::noArray(), keypoints, descriptors);
    orb.milliseconds.push_back(stopwatch.milliseconds());

    const FrameTimes times = pipeline.process(*item->frame).times;
    features.milliseconds.push_back(times.features);
    tracking.milliseconds.push_back(times.tracking);
    frame.milliseconds.push_back(times.features + times.tracking);
    if (options.max_frames > 0 && orb.milliseconds.size() >= options.max_frames) break;
  }
  if (orb.milliseconds.empty()) {
    throw UserError(fmt::format("{}: no frame could be read; see 'ipl_slam run'", options.folder.string()));
  }
  fmt::print("{} frames, one thread, lockstep, mapping excluded; milliseconds per frame\n",
             orb.milliseconds.size());
  for (const Samples* s : {&features, &tracking, &frame, &orb}) {
    fmt::print("  {:<28} mean {:7.3f}  median {:7.3f}\n", s->name, s->mean(), s->median());
  }
  fmt::print("  ratio frame / cv::ORB        mean {:7.3f}  median {:7.3f}\n", frame.mean() / orb.mean(),
             frame.median() / orb.median());
}

}  // namespace

void add_bench_verb(CLI::App& app) {
  auto* verb = app.add_subcommand("bench", "Measure accuracy and speed");
  verb->require_subcommand(1);
  auto* tracking =
      verb->add_subcommand("tracking", "Time per tracked frame, beside OpenCV's ORB on the same frames");
  auto options = std::make_shared<SequenceOptions>();
  options->add_to(*tracking);
  tracking->callback([options] { bench_tracking(*options); });
  add_bench_tum(*verb);
  add_bench_places(*verb);
  add_bench_cloud(*verb);
}

}  // namespace ipl_slam::cli
