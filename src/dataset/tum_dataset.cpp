#include "dataset/tum_dataset.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <system_error>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include <ipl_slam/error.hpp>

#include "dataset/image_file.hpp"

namespace ipl_slam {
namespace {

namespace fs = std::filesystem;

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error) && !fs::is_directory(path, error);
}

std::vector<double> timestamps(const std::vector<ListedImage>& images) {
  std::vector<double> stamps(images.size());
  std::transform(images.begin(), images.end(), stamps.begin(),
                 [](const ListedImage& i) { return i.timestamp; });
  return stamps;
}

/// Smallest difference between any two stamps of two increasing lists.
double closest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size(); a[i] < b[j] ? ++i : ++j) {
    best = std::min(best, std::abs(a[i] - b[j]));
  }
  return best;
}

[[noreturn]] void fail_without_overlap(const fs::path& rgb, const fs::path& depth,
                                       const std::vector<double>& color, const std::vector<double>& depths,
                                       double max_difference) {
  throw UserError(
      fmt::format("no colour image has a depth image within {} s: '{}' covers {:.6f} to {:.6f} s, '{}' "
                  "covers {:.6f} to {:.6f} s, "
                  "and the closest two images are {:.6f} s apart; check that both lists come from the same "
                  "recording and clock",
                  max_difference, rgb.string(), color.front(), color.back(), depth.string(), depths.front(),
                  depths.back(), closest_difference(color, depths)));
}

std::string type_name(const cv::Mat& image) {
  constexpr int bits_per_byte = 8;
  return fmt::format("{} bits, {} channel{}", image.elemSize1() * bits_per_byte, image.channels(),
                     image.channels() == 1 ? "" : "s");
}

std::string size_name(const cv::Mat& image) {
  return fmt::format("{}x{}", image.cols, image.rows);
}

SourceItem skip(double timestamp, std::string reason, std::string detail) {
  return {std::nullopt, timestamp, std::move(reason), std::move(detail)};
}

}  // namespace

TumDataset::TumDataset(const fs::path& folder, const Camera& camera, const TumDatasetOptions& options)
    : folder_(folder), camera_(camera) {
  std::error_code error;
  if (!fs::exists(folder, error)) {
    throw UserError(fmt::format("no such folder: '{}'; give a folder in TUM RGB-D layout", folder.string()));
  }
  if (!fs::is_directory(folder, error)) {
    throw UserError(fmt::format("'{}' is a file; give the folder of the sequence", folder.string()));
  }

  const fs::path rgb = folder / "rgb.txt", depth = folder / "depth.txt";
  if (!options.associations.empty()) {
    use_associations(folder / options.associations);
  } else if (is_file(rgb) && is_file(depth)) {
    use_lists(rgb, depth, options.max_difference);
  } else if (is_file(folder / "associations.txt")) {
    use_associations(folder / "associations.txt");
  } else if (is_file(folder / "associate.txt")) {
    use_associations(folder / "associate.txt");
  } else {
    throw UserError(fmt::format(
        "'{}' holds no {}; a sequence in TUM layout has rgb.txt and depth.txt, or associations.txt",
        folder.string(), is_file(rgb) ? "depth.txt" : "rgb.txt"));
  }
  // Pairs come before misplaced entries of the same time.
  std::stable_sort(entries_.begin(), entries_.end(),
                   [](const Entry& a, const Entry& b) { return a.order < b.order; });
}

void TumDataset::use_lists(const fs::path& rgb, const fs::path& depth, double max_difference) {
  const ImageList color_list = read_image_list(rgb), depth_list = read_image_list(depth);
  const std::vector<double> color_times = timestamps(color_list.images),
                            depth_times = timestamps(depth_list.images);
  for (const auto& [i, j] : associate(color_times, depth_times, max_difference)) {
    entries_.push_back({color_times[i], {color_list.images[i], depth_list.images[j]}, std::nullopt});
  }
  if (entries_.empty()) fail_without_overlap(rgb, depth, color_times, depth_times, max_difference);
  unpaired_color_ = color_times.size() - entries_.size();
  unpaired_depth_ = depth_times.size() - entries_.size();
  add_misplaced(color_list.misplaced);
  add_misplaced(depth_list.misplaced);
}

void TumDataset::use_associations(const fs::path& list) {
  PairList pairs = read_associations(list);
  for (ListedPair& pair : pairs.pairs)
    entries_.push_back({pair.color.timestamp, std::move(pair), std::nullopt});
  add_misplaced(pairs.misplaced);
}

void TumDataset::add_misplaced(const std::vector<MisplacedEntry>& misplaced) {
  for (const MisplacedEntry& entry : misplaced) {
    Entry position;
    position.order = entry.previous;
    position.misplaced = entry;
    entries_.push_back(std::move(position));
  }
}

std::optional<SourceItem> TumDataset::next() {
  if (position_ == entries_.size()) return std::nullopt;
  const std::size_t index = position_++;
  const Entry& entry = entries_[index];
  if (entry.misplaced)
    return skip(entry.misplaced->timestamp, entry.misplaced->reason, entry.misplaced->detail);
  return load(entry.pair, index);
}

SourceItem TumDataset::load(const ListedPair& pair, std::size_t index) const {
  const double time = pair.color.timestamp;
  const fs::path color_file = folder_ / pair.color.file, depth_file = folder_ / pair.depth.file;
  LoadedImage color = load_image(color_file);
  if (color.image.empty()) return skip(time, color.problem + " color image", color.detail);
  LoadedImage depth = load_image(depth_file);
  if (depth.image.empty()) return skip(time, depth.problem + " depth image", depth.detail);

  if (color.image.depth() != CV_8U) {
    return skip(time, "color image not 8-bit",
                fmt::format("{}: {}; colour images have 8 bits a channel", color_file.string(),
                            type_name(color.image)));
  }
  if (depth.image.type() != CV_16UC1) {
    return skip(time, "depth image not 16-bit",
                fmt::format("{}: {}; depth images have 16 bits, 1 channel", depth_file.string(),
                            type_name(depth.image)));
  }
  if (color.image.cols != camera_.width || color.image.rows != camera_.height) {
    return skip(time, "wrong image size",
                fmt::format("{}: {}; the camera '{}' gives {}x{}", color_file.string(),
                            size_name(color.image), camera_.name, camera_.width, camera_.height));
  }
  if (depth.image.size() != color.image.size()) {
    return skip(time, "color and depth differ in size",
                fmt::format("{}: {}, {}: {}", color_file.string(), size_name(color.image),
                            depth_file.string(), size_name(depth.image)));
  }
  if (color.image.channels() == 4) cv::cvtColor(color.image, color.image, cv::COLOR_BGRA2BGR);
  if (color.image.channels() == 2) cv::extractChannel(color.image, color.image, 0);  // grey with alpha
  return {RgbdFrame{index, time, std::move(color.image), std::move(depth.image)}, time, {}, {}};
}

std::optional<fs::path> TumDataset::ground_truth() const {
  const fs::path file = folder_ / "groundtruth.txt";
  return is_file(file) ? std::optional(file) : std::nullopt;
}

}  // namespace ipl_slam
