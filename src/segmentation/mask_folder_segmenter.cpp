#include "segmentation/mask_folder_segmenter.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <ipl_slam/error.hpp>

#include "common/text_file.hpp"
#include "dataset/image_file.hpp"

namespace ipl_slam {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxId = 65535;  // of 16 bits
constexpr const char* kIndex = "masks.txt";

UserError unreadable(const fs::path& path, const std::error_code& error) {
  return UserError(fmt::format("'{}' cannot be read ({}); check the folder of the masks and its permissions",
                               path.string(), error.message()));
}

bool is_there(const fs::path& file) {
  std::error_code error;
  const bool found = fs::exists(file, error);
  if (error) throw unreadable(file, error);
  return found;
}

// The PNG files whose names are timestamps, in order of time.
std::vector<ListedImage> images_named_by_time(const fs::path& folder) {
  std::vector<ListedImage> images;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const fs::path& file = entry->path();
    if (file.extension() != ".png") continue;
    const std::optional<double> time = parse_number(file.stem().string());
    if (time && std::isfinite(*time)) images.push_back({*time, file.filename().string()});
  }
  if (error) throw unreadable(folder, error);
  std::sort(images.begin(), images.end(), [](const ListedImage& a, const ListedImage& b) {
    return std::tie(a.timestamp, a.file) < std::tie(b.timestamp, b.file);
  });
  return images;
}

bool is_decimal(std::string_view word) {
  return word.find('.') != std::string_view::npos && parse_number(word);
}

std::vector<ListedImage> find_images(const fs::path& folder) {
  if (is_there(folder / kIndex)) return read_image_list(folder / kIndex).images;
  std::vector<ListedImage> images = images_named_by_time(folder);
  if (images.empty()) {
    throw UserError(fmt::format(
        "'{}' holds no masks: neither a list {} (lines \"timestamp file\") nor PNG files named by their "
        "timestamps, e.g. 1305031102.175304.png; give the folder of the label images",
        folder.string(), kIndex));
  }
  return images;
}

// What makes an image unfit as a label image, or nothing.
std::string unfit(const cv::Mat& image, cv::Size size) {
  if (image.channels() != 1) {
    return fmt::format("has {} channels, a label image has one (value = instance id); convert colours to ids",
                       image.channels());
  }
  if (image.depth() != CV_8U && image.depth() != CV_16U) return "has neither 8 nor 16 bits";
  if (image.size() != size) {
    return fmt::format("is {}x{}, the sequence {}x{}; masks must have the size of the colour images",
                       image.cols, image.rows, size.width, size.height);
  }
  return {};
}

template <class Label, class Visit>
void for_each_label(const cv::Mat& labels, const Visit& visit) {
  for (int y = 0; y < labels.rows; ++y) {
    const auto* row = labels.ptr<Label>(y);
    for (int x = 0; x < labels.cols; ++x) {
      if (row[x] != 0) visit(row[x], x, y);
    }
  }
}

template <class Label>
std::map<int, BitMask> split(const cv::Mat& labels, int min_area) {
  std::vector<int> area(kMaxId + 1);
  for_each_label<Label>(labels, [&](Label id, int, int) { ++area[id]; });
  std::map<int, BitMask> masks;
  std::vector<BitMask*> mask_of(area.size());
  for (int id = 1; id <= kMaxId; ++id) {
    if (area[id] >= min_area) mask_of[id] = &masks.emplace(id, labels.size()).first->second;
  }
  for_each_label<Label>(labels, [&](Label id, int x, int y) {
    if (mask_of[id] != nullptr) mask_of[id]->set(x, y);
  });
  return masks;
}

}  // namespace

MaskFolderSegmenter::MaskFolderSegmenter(const MaskFolderOptions& options, cv::Size image_size)
    : folder_(options.folder), options_(options), image_size_(image_size) {
  std::error_code error;
  if (options.folder.empty()) {
    throw UserError(
        "the segmenter masks needs a folder of masks; give one with --masks FOLDER or in the setting "
        "segmentation.masks.folder");
  }
  if (!fs::is_directory(folder_, error)) {
    throw UserError(fmt::format("'{}' is no folder; give the folder of the masks", options.folder));
  }
  images_ = find_images(folder_);
  // Where `ipl_slam synth` wrote them, lists stand beside the folder of images.
  const fs::path above = folder_ / "..";
  for (const fs::path& place : {folder_, is_there(above / "masks.txt") ? above : folder_}) {
    if (is_there(place / "classes.txt")) {
      classes_ = read_classes(place / "classes.txt");
    } else if (is_there(place / "objects.json")) {
      classes_ = read_objects(place / "objects.json");
    }
    if (!classes_.empty()) break;
  }

  LoadedImage first;
  std::string first_detail;
  auto image = images_.begin();
  for (; image != images_.end(); ++image) {
    first = load_image(folder_ / image->file);
    if (!first.image.empty()) break;
    if (first_detail.empty()) first_detail = first.detail;
  }
  if (image == images_.end()) {
    throw UserError(fmt::format("none of the {} masks of '{}' can be read, the first because: {}",
                                images_.size(), options.folder, first_detail));
  }
  if (const std::string what = unfit(first.image, image_size); !what.empty()) {
    throw UserError(fmt::format("{} {}", (folder_ / image->file).string(), what));
  }
}

MaskFolderSegmenter::ClassList MaskFolderSegmenter::read_classes(const fs::path& file) {
  ClassList classes;
  for (const TextLine& line : read_lines(file)) {
    const std::vector<std::string_view> words = split_words(line.text);
    const std::optional<double> id = parse_number(words[0]);
    // Names may hold blanks and whole numbers ("dining table", "class 3"): up to the first with a point.
    std::size_t end = 1;
    while (end < words.size() && !is_decimal(words[end])) ++end;
    const double score = end < words.size() ? *parse_number(words[end]) : 1.0;
    const bool good = id && *id >= 1 && *id <= kMaxId && *id == std::floor(*id) && end > 1 &&
                      end + 1 >= words.size() && score >= 0.0 && score <= 1.0;
    if (!good) {
      throw UserError(
          fmt::format("{}:{}: cannot understand '{}'; a line reads \"ID CLASS [SCORE]\", e.g. \"3 person "
                      "0.87\", ID from 1 to {}, SCORE from 0.0 to 1.0, with its decimal point, at the end",
                      file.string(), line.number, line.text, kMaxId));
    }
    const char* begin = words[1].data();
    const char* last = words[end - 1].data() + words[end - 1].size();
    classes[static_cast<int>(*id)] = {std::string(begin, last), static_cast<float>(score)};
  }
  return classes;
}

MaskFolderSegmenter::ClassList MaskFolderSegmenter::read_objects(const fs::path& file) {
  ClassList classes;
  try {
    for (const auto& object : nlohmann::json::parse(read_file(file))) {
      classes[object.at("id").get<int>()].class_name = object.at("class").get<std::string>();
    }
  } catch (const nlohmann::json::exception&) {
    throw UserError(fmt::format(
        "{}: cannot be understood; it must be a list of objects with \"id\" and \"class\", as `ipl_slam "
        "synth` writes it",
        file.string()));
  }
  return classes;
}

const ListedImage* MaskFolderSegmenter::nearest(double timestamp) const {
  const ListedImage* best = nullptr;
  const auto after = std::lower_bound(images_.begin(), images_.end(), timestamp,
                                      [](const ListedImage& a, double t) { return a.timestamp < t; });
  const auto consider = [&](const ListedImage& image) {
    if (best == nullptr || std::abs(image.timestamp - timestamp) < std::abs(best->timestamp - timestamp)) {
      best = &image;
    }
  };
  if (after != images_.begin()) consider(*std::prev(after));
  if (after != images_.end()) consider(*after);
  return best != nullptr && std::abs(best->timestamp - timestamp) < options_.max_difference ? best : nullptr;
}

std::vector<Instance> MaskFolderSegmenter::broken_file(const std::string& problem) {
  ++broken_;
  last_problem_ = problem;
  return {};
}

std::vector<Instance> MaskFolderSegmenter::segment(const RgbdFrame& frame) {
  ++frames_;
  const ListedImage* listed = nearest(frame.timestamp);
  const fs::path file = listed == nullptr ? fs::path() : folder_ / listed->file;
  std::error_code error;
  if (listed == nullptr || !fs::exists(file, error)) {
    ++missing_;
    return {};
  }
  const LoadedImage labels = load_image(file);
  if (labels.image.empty()) return broken_file(labels.detail);
  if (const std::string what = unfit(labels.image, image_size_); !what.empty()) {
    return broken_file(fmt::format("{} {}", file.string(), what));
  }
  const fs::path own_list = fs::path(file).replace_extension(".txt");
  try {
    return instances(labels.image, is_there(own_list) ? read_classes(own_list) : classes_);
  } catch (const UserError& broken_list) {
    return broken_file(broken_list.what());
  }
}

std::vector<std::string> MaskFolderSegmenter::remarks() const {
  std::vector<std::string> lines;
  if (missing_ > 0 && missing_ == frames_) {
    lines.push_back(fmt::format("none of the {} frames has a mask in '{}'; does it belong to this sequence?",
                                frames_, folder_.string()));
  } else if (missing_ > 0) {
    lines.push_back(fmt::format("{} of {} frames have no mask in '{}'", missing_, frames_, folder_.string()));
  }
  if (broken_ > 0) lines.push_back(fmt::format("{} masks could not be used: {}", broken_, last_problem_));
  return lines;
}

std::vector<Instance> MaskFolderSegmenter::instances(const cv::Mat& labels, const ClassList& classes) const {
  std::vector<Instance> result;
  for (auto& [id, mask] : labels.depth() == CV_8U ? split<std::uint8_t>(labels, options_.min_area)
                                                  : split<std::uint16_t>(labels, options_.min_area)) {
    const auto known = classes.find(id);
    const ClassScore& is = known != classes.end() ? known->second : ClassScore{};
    result.push_back({is.class_name, is.score, mask.bounding_box(), mask});
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const Instance& a, const Instance& b) { return a.score > b.score; });
  return result;
}

}  // namespace ipl_slam
