#include "bench_cloud.hpp"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "common/log.hpp"
#include "common/progress.hpp"
#include "dataset/camera_config.hpp"
#include "dataset/tum_dataset.hpp"
#include "dense/cloud_file.hpp"
#include "evaluation/cloud_error.hpp"
#include "mapped_sequence.hpp"
#include "output.hpp"
#include "segmentation/mask_folder_segmenter.hpp"
#include "sequence_options.hpp"
#include "verbs.hpp"

namespace ipl_slam::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct BenchCloudOptions {
  SequenceOptions sequence;
  fs::path run, masks, seen;
  double max_depth = 4.0;
  int every = 3;
  bool exact = false;
  bool json = false;
};

// Where something is that may walk off; empty without masks.
cv::Mat moving_mask(MaskFolderSegmenter* segmenter, const RgbdFrame& frame) {
  if (segmenter == nullptr) return {};
  BitMask moving(frame.depth.size());
  for (const Instance& instance : segmenter->segment(frame)) {
    if (may_walk_off(instance)) moving |= instance.mask;
  }
  return moving.to_image();
}

constexpr double kSameTime = 1e-4;  // s: rendered sequences have the same times to the microsecond

// The frame of another recording of the same path at a time; frames must be asked for in order.
class SameTime {
 public:
  SameTime(const fs::path& folder, const Camera& camera) : source_(folder, camera) {}

  [[nodiscard]] std::optional<RgbdFrame> at(double timestamp) {
    while (!next_ || next_->timestamp < timestamp - kSameTime) {
      next_ = source_.next();
      if (!next_) return std::nullopt;
    }
    return next_->timestamp < timestamp + kSameTime ? next_->frame : std::nullopt;
  }

 private:
  TumDataset source_;
  std::optional<SourceItem> next_;
};

CloudTruth read_truth(const BenchCloudOptions& options, const Camera& camera, TumDataset& source,
                      const TruePoses& poses) {
  std::optional<MaskFolderSegmenter> segmenter;
  if (!options.masks.empty()) {
    segmenter.emplace(MaskFolderOptions{.folder = options.masks.string()},
                      cv::Size(camera.width, camera.height));
  }
  std::optional<SameTime> seen;
  if (!options.seen.empty()) seen.emplace(options.seen, camera);
  CloudTruth truth(camera, options.max_depth, options.exact);
  std::optional<ProgressBar> bar;
  if (says_remarks()) bar.emplace("reading the truth", source.size());
  for (std::size_t i = 0; auto item = source.next(); ++i) {
    if (bar) bar->advance();
    if (!item->frame || i % static_cast<std::size_t>(options.every) != 0) continue;
    const std::optional<SE3> T_wc = poses.at(item->timestamp);
    if (!T_wc) continue;
    cv::Mat depth = item->frame->depth;
    if (seen) {
      const std::optional<RgbdFrame> frame = seen->at(item->timestamp);
      if (!frame) continue;
      depth.setTo(0, frame->depth == 0);
    }
    truth.add(depth, moving_mask(segmenter ? &*segmenter : nullptr, *item->frame), *T_wc);
  }
  if (truth.empty()) {
    throw UserError(fmt::format(
        "'{}': no frame with a true pose shows a surface nearer than {:g} m; check the images and --camera",
        options.sequence.folder.string(), options.max_depth));
  }
  return truth;
}

Json error_json(const CloudError& error, bool with_ghosts) {
  return {{"points", error.points},
          {"mean_m", error.mean},
          {"median_m", error.median},
          {"far_share", error.far},
          {"completeness", error.completeness},
          {"ghost_share", with_ghosts ? Json(error.ghosts) : Json(nullptr)}};
}

void print(const CloudError& error, bool with_ghosts) {
  fmt::print("points         {}\n", error.points);
  fmt::print("distance       mean {:.2f} mm, median {:.2f} mm\n", 1000.0 * error.mean, 1000.0 * error.median);
  fmt::print("far off        {:.3f} % of the points are {:g} cm or more from any surface\n",
             100.0 * error.far, 100.0 * CloudError::kFar);
  fmt::print("completeness   {:.2f} % of what was seen has a point within {:g} cm\n",
             100.0 * error.completeness, 100.0 * CloudError::kComplete);
  if (!with_ghosts) return;
  fmt::print(
      "ghosts         {:.4f} % of the points ({:.0f}) lie within {:g} cm of where somebody was who moved\n",
      100.0 * error.ghosts, error.ghosts * static_cast<double>(error.points), 100.0 * CloudError::kOnMover);
}

void bench_cloud(const BenchCloudOptions& options) {
  if (options.json) set_log_level(LogLevel::kQuiet);  // alone, so that another program can read it
  const Camera camera = options.sequence.load_camera();
  TumDataset source(options.sequence.folder, camera, options.sequence.dataset_options());
  const std::optional<fs::path> truth_file = source.ground_truth();
  if (!truth_file) {
    throw UserError(fmt::format("'{}' has no ground truth: there is nothing to compare with",
                                options.sequence.folder.string()));
  }
  const Trajectory truth = read_trajectory(*truth_file);
  const SemanticCloud cloud = read_cloud(options.run / "cloud.ply");
  // What `map export` writes has keyframes only.
  const fs::path all = options.run / "trajectory.txt", some = options.run / "keyframes.txt";
  const SE3 T_ge = align_poses(truth, read_trajectory(fs::exists(all) ? all : some));
  const TruePoses poses(truth);
  const CloudError error = read_truth(options, camera, source, poses).compare(cloud, T_ge);
  const bool with_ghosts = !options.masks.empty();
  options.json ? fmt::print("{}", json_text(error_json(error, with_ghosts))) : print(error, with_ghosts);
}

}  // namespace

void add_bench_cloud(CLI::App& bench) {
  CLI::App* verb = bench.add_subcommand(
      "cloud", "The cloud of a run beside the depth images at their true poses: distances, ghosts, gaps");
  const auto options = std::make_shared<BenchCloudOptions>();
  verb->add_option("sequence", options->sequence.folder,
                   "Sequence with ground truth; of a rendered one the same with --no-noise")
      ->type_name("FOLDER")
      ->check(not_empty())
      ->required();
  verb->add_option("--camera", options->sequence.camera, "As for 'run'")->type_name("NAME|FILE");
  verb->add_option("run", options->run,
                   "Results of `ipl_slam run` or `map export`: cloud.ply and trajectory.txt or keyframes.txt")
      ->type_name("RUN_DIR")
      ->check(not_empty())
      ->required();
  verb->add_option("--masks", options->masks,
                   "Masks of the sequence, to tell what moves (as `run --masks` takes them): count ghosts")
      ->type_name("FOLDER");
  verb->add_option("--max-depth", options->max_depth, "Surfaces beyond this are not asked for, m")
      ->check(CLI::Range(0.1, 100.0))
      ->capture_default_str();
  verb->add_option("--every", options->every, "Take every so many frames")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  verb->add_option(
          "--seen", options->seen,
          "The sequence as the run saw it, where SEQUENCE is the same without noise: what had no depth "
          "there is not asked for")
      ->type_name("FOLDER");
  verb->add_flag("--exact", options->exact,
                 "The sequence was rendered with --no-noise: measure to the surfaces between its pixels");
  verb->add_flag("--json", options->json, "Print the figures as JSON");
  verb->callback([options] { bench_cloud(*options); });
}

}  // namespace ipl_slam::cli
