#include "dense/keyframe_folder.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include <ipl_slam/error.hpp>

#include "common/atomic_file.hpp"
#include "common/text_file.hpp"
#include "dataset/camera_config.hpp"
#include "dataset/image_file.hpp"
#include "dense/view_maker.hpp"

namespace ipl_slam {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr const char* kIndex = "keyframes.json";
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kMostInstances = 255;  // of a view

// --- writing ---

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    throw UserError(fmt::format("cannot make the folder '{}' ({}); choose a place you may write to",
                                folder.string(), error.message()));
  }
}

/// The lists of a folder while its images are written.
class FolderWriter {
 public:
  FolderWriter(const fs::path& folder, const ViewStore& store) : folder_(folder), store_(store) {}

  void add(KeyframeId id) {
    const double timestamp = store_.timestamp(id);
    const std::string name = free_name(id);
    const std::string color = "rgb/" + name + ".jpg", depth = "depth/" + name + ".png",
                      labels = "masks/" + name + ".png";
    write_file_atomically(folder_ / color, store_.color_jpeg(id));
    write_image_atomically(folder_ / depth, store_.depth(id));
    write_image_atomically(folder_ / labels, store_.labels(id));
    write_file_atomically(folder_ / ("masks/" + name + ".txt"), classes(id));
    rgb_list_ += fmt::format("{:.6f} {}\n", timestamp, color);
    depth_list_ += fmt::format("{:.6f} {}\n", timestamp, depth);
    mask_list_ += fmt::format("{:.6f} {}\n", timestamp, labels);
    keyframes_.push_back({{"id", id.value},
                          {"timestamp", timestamp},
                          {"color", color},
                          {"depth", depth},
                          {"labels", labels},
                          {"instances", instances(id)}});
  }

  void finish(const std::set<InstanceId>& moved, const Camera& camera) {
    write_file_atomically(folder_ / "camera.yaml", camera_yaml(pinhole(camera)));
    write_file_atomically(folder_ / "rgb.txt", rgb_list_);
    write_file_atomically(folder_ / "depth.txt", depth_list_);
    write_file_atomically(folder_ / "masks.txt", mask_list_);
    ordered_json ids = ordered_json::array();
    for (const InstanceId id : moved) ids.push_back(id.value);
    const ordered_json index = {{"version", kVersion}, {"moved", ids}, {"keyframes", keyframes_}};
    write_file_atomically(folder_ / kIndex, text_of(index));
  }

 private:
  // Names that users gave to classes need not be UTF-8.
  static std::string text_of(const ordered_json& json) {
    return json.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
  }

  // Keyframes of two recordings may have been taken at the same time.
  std::string free_name(KeyframeId id) {
    std::string name = fmt::format("{:.6f}", store_.timestamp(id));
    if (!names_.insert(name).second) name += fmt::format("-{}", id.value);
    return name;
  }

  [[nodiscard]] ordered_json instances(KeyframeId id) const {
    ordered_json list = ordered_json::array();
    for (const ViewInstance& instance : store_.instances(id)) {
      list.push_back({{"id", instance.id.value}, {"class", instance.class_name}, {"score", instance.score}});
    }
    return list;
  }

  // As MaskFolderSegmenter reads it.
  [[nodiscard]] std::string classes(KeyframeId id) const {
    std::string text;
    int label = 0;
    for (const ViewInstance& instance : store_.instances(id)) {
      const std::string& name = instance.class_name;
      text += fmt::format("{} {} {:.6f}\n", ++label, name.empty() ? "unknown" : name, instance.score);
    }
    return text;
  }

  fs::path folder_;
  const ViewStore& store_;
  std::set<std::string> names_;
  std::string rgb_list_ = "# timestamp file\n", depth_list_ = rgb_list_, mask_list_ = rgb_list_;
  ordered_json keyframes_ = ordered_json::array();
};

std::vector<KeyframeId> by_time(const ViewStore& store) {
  std::vector<KeyframeId> ids = store.ids();
  std::stable_sort(ids.begin(), ids.end(),
                   [&](KeyframeId a, KeyframeId b) { return store.timestamp(a) < store.timestamp(b); });
  return ids;
}

// --- reading ---

/// keyframes.json and the images that it names.
class FolderReader {
 public:
  explicit FolderReader(const fs::path& folder) : folder_(folder), index_(folder / kIndex) {}

  std::set<InstanceId> read_into(ViewStore& store) {
    ordered_json json;
    try {
      json = ordered_json::parse(read_file(index_));
    } catch (const ordered_json::exception&) {
      fail("it is no JSON");
    }
    if (number_of(json, "version") != kVersion) {
      fail(fmt::format("its version is not {}, the one this program reads", kVersion));
    }
    std::set<InstanceId> moved;
    for (const ordered_json& id : list(json, "moved")) moved.insert(InstanceId{number(id, "moved")});
    for (const ordered_json& keyframe : list(json, "keyframes")) add(keyframe, store);
    return moved;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw UserError(
        fmt::format("{}: cannot be used: {}; write the folder of keyframes again", index_.string(), what));
  }
  [[noreturn]] static void fail(const fs::path& file, const std::string& what) {
    throw UserError(fmt::format("{}: {}; write the folder of keyframes again", file.string(), what));
  }

  void add(const ordered_json& keyframe, ViewStore& store) const {
    const KeyframeId id{number_of(keyframe, "id")};
    if (store.holds(id)) fail(fmt::format("the keyframe {} is given twice", id.value));
    DenseView view;
    view.timestamp = real(keyframe, "timestamp");
    for (const ordered_json& entry : list(keyframe, "instances")) view.instances.push_back(instance(entry));
    if (view.instances.size() > kMostInstances) fail("a keyframe has more than 255 instances");
    const std::string color = jpeg(file(keyframe, "color"), store.image_size());
    view.depth = image(file(keyframe, "depth"), CV_16UC1, store.image_size());
    const fs::path labels = file(keyframe, "labels");
    view.labels = image(labels, CV_8UC1, store.image_size());
    double most = 0.0;
    cv::minMaxLoc(view.labels, nullptr, &most);
    if (most > static_cast<double>(view.instances.size())) {
      fail(labels,
           fmt::format("has the label {}, but {} lists {} instances", most, kIndex, view.instances.size()));
    }
    store.add(id, view, color);
  }

  [[nodiscard]] ViewInstance instance(const ordered_json& entry) const {
    return {InstanceId{number_of(entry, "id")}, text(entry, "class"),
            static_cast<float>(real(entry, "score"))};
  }

  static cv::Mat image(const fs::path& file, int type, cv::Size size) {
    LoadedImage loaded = load_image(file);
    if (loaded.image.empty()) throw UserError(loaded.detail + "; write the folder of keyframes again");
    if (loaded.image.type() != type) {
      fail(file, fmt::format("is not of {} bits with 1 channel", type == CV_8UC1 ? 8 : 16));
    }
    check_size(file, loaded.image.size(), size);
    return loaded.image;
  }

  static std::string jpeg(const fs::path& file, cv::Size size) {
    std::string bytes = read_file(file);
    if (!jpeg_is_complete(bytes)) fail(file, "is no JPEG file, or not a whole one");
    const LoadedImage loaded = load_image(file);
    if (loaded.image.empty()) throw UserError(loaded.detail + "; write the folder of keyframes again");
    check_size(file, loaded.image.size(), size);
    return bytes;
  }

  static void check_size(const fs::path& file, cv::Size found, cv::Size wanted) {
    if (found == wanted) return;
    fail(file, fmt::format("is {}x{}, the camera's images are {}x{}", found.width, found.height, wanted.width,
                           wanted.height));
  }

  [[nodiscard]] const ordered_json& field(const ordered_json& object, const char* key) const {
    if (!object.is_object() || !object.contains(key)) fail(fmt::format("a '{}' is missing", key));
    return object.at(key);
  }
  [[nodiscard]] const ordered_json& list(const ordered_json& object, const char* key) const {
    const ordered_json& value = field(object, key);
    if (!value.is_array()) fail(fmt::format("'{}' is no list", key));
    return value;
  }
  [[nodiscard]] std::uint32_t number(const ordered_json& value, const char* key) const {
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() >= KeyframeId::kInvalid) {
      fail(fmt::format("'{}' is no whole number below {}", key, KeyframeId::kInvalid));
    }
    return value.get<std::uint32_t>();
  }
  [[nodiscard]] std::uint32_t number_of(const ordered_json& object, const char* key) const {
    return number(field(object, key), key);
  }
  [[nodiscard]] double real(const ordered_json& object, const char* key) const {
    const ordered_json& value = field(object, key);
    if (!value.is_number() || !std::isfinite(value.get<double>()))
      fail(fmt::format("'{}' is no number", key));
    return value.get<double>();
  }
  [[nodiscard]] std::string text(const ordered_json& object, const char* key) const {
    const ordered_json& value = field(object, key);
    if (!value.is_string()) fail(fmt::format("'{}' is no text", key));
    return value.get<std::string>();
  }

  [[nodiscard]] fs::path file(const ordered_json& object, const char* key) const {
    const std::string name = text(object, key);
    const auto is_control = [](char c) { return static_cast<unsigned char>(c) < ' '; };
    if (std::any_of(name.begin(), name.end(), is_control)) fail(fmt::format("'{}' names no file", key));
    return folder_ / name;
  }

  fs::path folder_, index_;
};

}  // namespace

void write_keyframe_folder(const fs::path& folder, const ViewStore& store, const std::set<InstanceId>& moved,
                           const Camera& camera) {
  for (const char* name : {"rgb", "depth", "masks"}) make_folder(folder / name);
  std::error_code ignored;  // where it cannot be removed it cannot be written either, which is reported
  fs::remove(folder / kIndex, ignored);
  FolderWriter writer(folder, store);
  for (const KeyframeId id : by_time(store)) writer.add(id);
  writer.finish(moved, camera);
}

std::set<InstanceId> read_keyframe_folder(const fs::path& folder, ViewStore& store) {
  return FolderReader(folder).read_into(store);
}

}  // namespace ipl_slam
