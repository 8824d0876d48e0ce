#include <algorithm>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include <ipl_slam/error.hpp>

#include "common/atomic_file.hpp"
#include "common/interrupt.hpp"
#include "common/log.hpp"
#include "common/progress.hpp"
#include "common/stopwatch.hpp"
#include "dataset/image_file.hpp"
#include "dataset/prefetching_source.hpp"
#include "evaluation/mask_score.hpp"
#include "evaluation/statistics.hpp"
#include "frame_folder.hpp"
#include "output.hpp"
#include "pipeline/instance_log.hpp"
#include "pipeline/instance_overlay.hpp"
#include "segmentation/instance_tracker.hpp"
#include "segmentation/make_segmenter.hpp"
#include "segmenter_choice.hpp"
#include "sequence_options.hpp"
#include "verbs.hpp"

namespace ipl_slam::cli {
namespace {

namespace fs = std::filesystem;

struct SegmentOptions {
  SequenceOptions sequence;
  SegmenterChoice segmenter;
  fs::path output;
  bool save_masks = false;
  fs::path truth;
  double truth_min_area = 0.01;
};

// Milliseconds per image; the parts are known of a network only.
struct Times {
  std::vector<double> total, preprocess, inference, postprocess;

  void add(double milliseconds, const Segmenter& segmenter) {
    total.push_back(milliseconds);
    if (const auto* yolo = dynamic_cast<const YoloSegmenter*>(&segmenter)) {
      preprocess.push_back(yolo->times().preprocess);
      inference.push_back(yolo->times().inference);
      postprocess.push_back(yolo->times().postprocess);
    }
  }

  void print() const {
    const auto line = [](const char* name, const std::vector<double>& values) {
      if (values.empty()) return;
      const Statistics s = run_statistics(values);
      fmt::print("  {:<12} mean {:8.2f}  median {:8.2f}\n", name, s.mean, s.median);
    };
    fmt::print("time per image, ms\n");
    line("total", total);
    line("preprocess", preprocess);
    line("inference", inference);
    line("postprocess", postprocess);
  }
};

BitMask union_of(const std::vector<Instance>& instances, cv::Size size) {
  BitMask all(size);
  for (const Instance& instance : instances) all |= instance.mask;
  return all;
}

// Compares with true masks where these cover enough of the image.
class Judge {
 public:
  Judge(const fs::path& folder, double min_area, cv::Size size)
      : truth_({.folder = folder.string(), .min_area = 1}, size), min_area_(min_area) {}

  void add(const RgbdFrame& frame, const std::vector<Instance>& found) {
    const BitMask truth = union_of(truth_.segment(frame), frame.color.size());
    if (truth.none() || truth.area() < min_area_ * frame.color.size().area()) return;
    score_.add(union_of(found, frame.color.size()), truth);
    ++frames_;
  }
  void print() const {
    for (const std::string& remark : truth_.remarks()) log().warn("{}", remark);
    fmt::print("pixels against the truth, over the {} frames where it covers {:g} % of the image or more\n",
               frames_, 100.0 * min_area_);
    if (frames_ == 0) return;
    fmt::print("  recall {:.3f}, precision {:.3f}, false area {:.2f} % of the image\n", score_.recall(),
               score_.precision(), 100.0 * score_.false_area());
  }

 private:
  MaskFolderSegmenter truth_;
  double min_area_;
  MaskScore score_;
  std::size_t frames_ = 0;
};

// A label image and what its values mean, as the "masks" segmenter reads them.
void save_masks(const FrameFolder& folder, const RgbdFrame& frame, std::vector<TrackedInstance> instances) {
  // What was only carried here nobody has seen in this frame.
  std::erase_if(instances, [](const TrackedInstance& t) { return t.frames_carried > 0; });
  constexpr unsigned kLabels = 65535;  // that 16 bits hold besides 0
  std::stable_sort(instances.begin(), instances.end(),
                   [](const TrackedInstance& a, const TrackedInstance& b) {
                     return a.instance.score < b.instance.score;  // the best is painted last
                   });
  cv::Mat labels = cv::Mat::zeros(frame.color.size(), CV_16UC1);
  std::string classes;
  for (const TrackedInstance& t : instances) {
    const unsigned label = t.id.value % kLabels + 1;
    labels.setTo(cv::Scalar(label), t.instance.mask.to_image());
    classes += fmt::format("{} {} {:.4f}\n", label, t.instance.class_name, t.instance.score);
  }
  folder.add(frame.timestamp, ".png", labels);
  folder.add(frame.timestamp, ".txt", classes);
}

fs::path made_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    throw UserError(fmt::format("cannot create the folder '{}': {}; choose another with -o", folder.string(),
                                error.message()));
  }
  return folder;
}

cv::Mat read_image(const fs::path& file) {
  LoadedImage loaded = load_image(file);
  if (loaded.image.empty()) throw UserError(loaded.detail);
  if (loaded.image.depth() != CV_8U) {
    throw UserError(fmt::format("'{}' is not an 8-bit image; give a colour or grey picture", file.string()));
  }
  if (loaded.image.channels() == 4) cv::cvtColor(loaded.image, loaded.image, cv::COLOR_BGRA2BGR);
  return loaded.image;
}

void segment_image(const SegmentOptions& options, const Config& config) {
  const fs::path& file = options.sequence.folder;
  if (config.segmentation.segmenter != "yolo") {
    throw UserError(fmt::format("'{}': a single image needs a network; give --model FILE", file.string()));
  }
  if (options.save_masks || !options.truth.empty()) {
    throw UserError(
        fmt::format("'{}' is a single image; --save-masks and --truth are for sequences", file.string()));
  }
  YoloSegmenter segmenter(config.segmentation.yolo);
  RgbdFrame frame;
  frame.color = read_image(file);
  (void)segmenter.segment(frame);  // the first call allocates; it says nothing about speed
  const Stopwatch stopwatch;
  const std::vector<Instance> found = segmenter.segment(frame);
  Times times;
  times.add(stopwatch.milliseconds(), segmenter);

  std::vector<TrackedInstance> shown;
  for (const Instance& instance : found) {
    fmt::print("{:>3}  {:<15} score {:.2f}  box {} {} {} {}  area {}\n", shown.size(), instance.class_name,
               instance.score, instance.box.x, instance.box.y, instance.box.width, instance.box.height,
               instance.mask.area());
    shown.push_back({InstanceId{static_cast<std::uint32_t>(shown.size())}, instance, 0});
  }
  const fs::path picture = made_folder(options.output) / (file.stem().string() + "_instances.jpg");
  write_image_atomically(picture, draw_instances(frame.color, shown));
  const cv::Size input = segmenter.input_size(frame.color.size());
  fmt::print("{} instances, network input {}x{}\n", found.size(), input.width, input.height);
  for (const std::string& remark : segmenter.remarks()) log().warn("{}", remark);
  times.print();
  fmt::print("picture in {}\n", picture.string());
}

// What is made of a sequence: files per frame, and figures for the end.
class SequenceResult {
 public:
  SequenceResult(const SegmentOptions& options, std::optional<Judge> judge)
      : output_(made_folder(options.output)), overlays_(output_ / "overlays"), judge_(std::move(judge)) {
    if (options.save_masks) masks_.emplace(output_ / "masks");
  }

  void add(const RgbdFrame& frame, const std::vector<Instance>& found,
           const std::vector<TrackedInstance>& tracked) {
    instances_ += found.size();
    if (judge_) judge_->add(frame, found);
    overlays_.add(frame.timestamp, ".jpg", draw_instances(frame.color, tracked));
    if (masks_) save_masks(*masks_, frame, tracked);
    std::vector<InstanceRecord> records;
    for (const TrackedInstance& t : tracked) records.push_back(record_of(t));
    lines_ += instances_line(frame.index, frame.timestamp, 0, records);
  }

  void write() {
    overlays_.keep();
    if (masks_) masks_->keep();
    write_file_atomically(output_ / "instances.jsonl", lines_);
  }
  void print(const Segmenter& segmenter, const Times& times, std::size_t skipped) const {
    for (const std::string& remark : segmenter.remarks()) log().warn("{}", remark);
    fmt::print("{} images, {} skipped, {} instances found by {}\n", times.total.size(), skipped, instances_,
               segmenter.name());
    times.print();
    if (judge_) judge_->print();
    fmt::print("results in {}\n", output_.string());
  }

 private:
  fs::path output_;
  FrameFolder overlays_;
  std::optional<FrameFolder> masks_;
  std::optional<Judge> judge_;
  std::string lines_;  // of instances.jsonl
  std::size_t instances_ = 0;
};

void segment_sequence(const SegmentOptions& options, const Config& config) {
  const Camera camera = options.sequence.load_camera();
  PrefetchingSource source(
      std::make_unique<TumDataset>(options.sequence.folder, camera, options.sequence.dataset_options()));
  const std::unique_ptr<Segmenter> segmenter =
      make_segmenter(config.segmentation, camera, config.schedule.seed);
  if (!segmenter) throw UserError("--segmenter none leaves nothing to do; choose yolo, masks or geometric");
  InstanceTracker tracker(camera, config.instances, config.mask_carrier);
  std::optional<Judge> judge;
  if (!options.truth.empty()) {
    judge.emplace(options.truth, options.truth_min_area, cv::Size(camera.width, camera.height));
  }
  SequenceResult result(options, std::move(judge));
  install_interrupt_handler();

  const std::size_t limit = options.sequence.max_frames;
  std::optional<ProgressBar> bar;
  if (says_remarks()) bar.emplace("segmenting", limit > 0 ? std::min(limit, source.size()) : source.size());
  Times times;
  std::size_t skipped = 0;
  for (std::size_t taken = 0; !interrupted() && (limit == 0 || taken < limit); ++taken) {
    const std::optional<SourceItem> item = source.next();
    if (!item) break;
    if (bar) bar->advance();
    if (!item->frame) {
      ++skipped;
      continue;
    }
    const RgbdFrame& frame = *item->frame;
    const Stopwatch stopwatch;
    const std::vector<Instance> found = segmenter->segment(frame);
    times.add(stopwatch.milliseconds(), *segmenter);
    result.add(frame, found, tracker.update(tracker.view(frame), found));
  }
  bar.reset();
  if (times.total.empty() && !interrupted()) {
    throw UserError(fmt::format("'{}': none of its frames could be used; see 'ipl_slam run'",
                                options.sequence.folder.string()));
  }
  result.write();
  if (interrupted()) {
    log().warn("interrupted; the results cover what was read until then");
    exit_code() = kInterrupted;
  }
  result.print(*segmenter, times, skipped);
}

void segment(const SegmentOptions& options) {
  Config config = options.sequence.load_config();
  options.segmenter.apply(config);
  options.sequence.check_output(options.output);
  const fs::path& what = options.sequence.folder;
  std::error_code error;
  if (!fs::exists(what, error)) throw UserError(fmt::format("'{}': no such image or folder", what.string()));
  fs::is_regular_file(what, error) ? segment_image(options, config) : segment_sequence(options, config);
}

}  // namespace

void add_segment_verb(CLI::App& app) {
  auto* verb = app.add_subcommand(
      "segment", "Find the instances in an image, or in every frame of a sequence, and draw them");
  auto options = std::make_shared<SegmentOptions>();
  options->sequence.add_to(*verb, "An image, or a folder in TUM RGB-D layout");
  options->segmenter.add_to(*verb);
  verb->add_option("-o,--output", options->output,
                   "Folder for the results, made if need be: a picture, or for a sequence overlays/ and "
                   "instances.jsonl")
      ->type_name("DIR")
      ->check(not_empty())
      ->required();
  verb->add_flag(
      "--save-masks", options->save_masks,
      "Sequence: write the masks to DIR/masks as well, for --masks; a pixel's value is its instance's id "
      "+ 1");
  verb->add_option("--truth", options->truth,
                   "Sequence: folder of label images with the true masks; prints how far the pixels agree")
      ->type_name("FOLDER")
      ->check(not_empty());
  verb->add_option("--truth-min-area", options->truth_min_area,
                   "Share of the image that the true masks must cover for a frame to count")
      ->type_name("SHARE")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  verb->callback([options] { segment(*options); });
}

}  // namespace ipl_slam::cli
