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
constexpr double kFarthest = 1e6;  // m, of a view from its keyframe: farther, voxels have no numbers

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

  void add(KeyframeId id, const KeptKeyframe& kept) {
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
    const Eigen::Vector3d& t = kept.T_c_reference.translation();
    const Eigen::Quaterniond& q = kept.T_c_reference.rotation();
    keyframes_.push_back(
        {{"timestamp", timestamp},
         {"reference_time", kept.reference_time},
         {"reference_fingerprint", kept.reference_fingerprint},
         {"T_c_reference",
          {{"translation", {t.x(), t.y(), t.z()}}, {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}}}},
         {"color", color},
         {"depth", depth},
         {"labels", labels},
         {"instances", instances(id, kept.moved)}});
  }

  void finish(const Camera& camera) {
    write_file_atomically(folder_ / "camera.yaml", camera_yaml(pinhole(camera)));
    write_file_atomically(folder_ / "rgb.txt", rgb_list_);
    write_file_atomically(folder_ / "depth.txt", depth_list_);
    write_file_atomically(folder_ / "masks.txt", mask_list_);
    const ordered_json index = {{"version", kVersion}, {"keyframes", keyframes_}};
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

  [[nodiscard]] ordered_json instances(KeyframeId id, const std::set<InstanceId>& moved) const {
    ordered_json list = ordered_json::array();
    for (const ViewInstance& instance : store_.instances(id)) {
      list.push_back({{"id", instance.id.value},
                      {"class", instance.class_name},
                      {"score", instance.score},
                      {"moved", moved.contains(instance.id)}});
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

// --- reading ---

/// keyframes.json and the images that it names.
class FolderReader {
 public:
  explicit FolderReader(const fs::path& folder) : folder_(folder), index_(folder / kIndex) {}

  KeptKeyframes read_into(ViewStore& store) {
    KeyframeId next{0};
    for (const KeyframeId id : store.ids()) {
      next.value = id.value + 1;
      for (const ViewInstance& i : store.instances(id)) {
        first_instance_ = std::max(first_instance_, i.id.value + 1);
      }
    }
    ordered_json json;
    try {
      json = ordered_json::parse(read_file(index_));
    } catch (const ordered_json::exception&) {
      fail("it is no JSON");
    }
    if (number_of(json, "version") != kVersion) {
      fail(fmt::format("its version is not {}, the one this program reads", kVersion));
    }
    KeptKeyframes kept;
    for (const ordered_json& keyframe : list(json, "keyframes")) {
      kept.emplace(next, add(keyframe, store, next));
      ++next.value;
    }
    return kept;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw UserError(
        fmt::format("{}: cannot be used: {}; write the folder of keyframes again", index_.string(), what));
  }
  [[noreturn]] static void fail(const fs::path& file, const std::string& what) {
    throw UserError(fmt::format("{}: {}; write the folder of keyframes again", file.string(), what));
  }

  KeptKeyframe add(const ordered_json& keyframe, ViewStore& store, KeyframeId id) const {
    KeptKeyframe kept{real(keyframe, "reference_time"),
                      text(keyframe, "reference_fingerprint"),
                      pose(field(keyframe, "T_c_reference")),
                      {}};
    DenseView view;
    view.timestamp = real(keyframe, "timestamp");
    for (const ordered_json& entry : list(keyframe, "instances")) {
      view.instances.push_back(instance(entry));
      if (flag(entry, "moved")) kept.moved.insert(view.instances.back().id);
    }
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
    return kept;
  }

  [[nodiscard]] SE3 pose(const ordered_json& object) const {
    const std::vector<double> t = reals(object, "translation", 3), q = reals(object, "rotation_xyzw", 4);
    const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
    if (std::abs(rotation.norm() - 1.0) > 1e-6) fail("'rotation_xyzw' is no unit quaternion");
    for (const double x : t) {
      if (std::abs(x) > kFarthest) fail(fmt::format("'translation' is more than {} m", kFarthest));
    }
    return SE3::of_unit(rotation, {t[0], t[1], t[2]});
  }

  [[nodiscard]] ViewInstance instance(const ordered_json& entry) const {
    const std::uint64_t id = std::uint64_t{first_instance_} + number_of(entry, "id");
    if (id >= InstanceId::kInvalid) fail("its instances have too large numbers");
    const double score = real(entry, "score");
    if (score < 0.0 || score > 1.0) fail("a 'score' is not between 0 and 1");
    return {InstanceId{static_cast<std::uint32_t>(id)}, text(entry, "class"), static_cast<float>(score)};
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
  [[nodiscard]] std::vector<double> reals(const ordered_json& object, const char* key,
                                          std::size_t count) const {
    std::vector<double> values;
    for (const ordered_json& value : list(object, key)) {
      if (!value.is_number() || !std::isfinite(value.get<double>()))
        fail(fmt::format("'{}' holds no numbers", key));
      values.push_back(value.get<double>());
    }
    if (values.size() != count) fail(fmt::format("'{}' has not {} numbers", key, count));
    return values;
  }
  [[nodiscard]] bool flag(const ordered_json& object, const char* key) const {
    const ordered_json& value = field(object, key);
    if (!value.is_boolean()) fail(fmt::format("'{}' is neither true nor false", key));
    return value.get<bool>();
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
  std::uint32_t first_instance_ = 0;
};

}  // namespace

void write_keyframe_folder(const fs::path& folder, const ViewStore& store, const KeptKeyframes& kept,
                           const Camera& camera) {
  for (const char* name : {"rgb", "depth", "masks"}) make_folder(folder / name);
  // What tells clear_keyframe_folder() that the folder is one of ours, and readers that it is not whole.
  write_file_atomically(folder / kIndex, fmt::format("{{\"version\": {}}}\n", kVersion));
  std::vector<KeyframeId> ids;
  for (const auto& [id, keyframe] : kept) ids.push_back(id);
  std::stable_sort(ids.begin(), ids.end(),
                   [&](KeyframeId a, KeyframeId b) { return store.timestamp(a) < store.timestamp(b); });
  FolderWriter writer(folder, store);
  for (const KeyframeId id : ids) writer.add(id, kept.at(id));
  writer.finish(camera);
}

KeptKeyframes read_keyframe_folder(const fs::path& folder, ViewStore& store) {
  return FolderReader(folder).read_into(store);
}

void clear_keyframe_folder(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::exists(folder / kIndex, ignored)) return;
  for (const auto& [name, ending] :
       {std::pair("rgb", ".jpg"), {"depth", ".png"}, {"masks", ".png"}, {"masks", ".txt"}}) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder / name, ignored)) {
      if (entry.path().extension() == ending) files.push_back(entry.path());
    }
    for (const fs::path& file : files) fs::remove(file, ignored);
    fs::remove(folder / name, ignored);
  }
  for (const char* name : {kIndex, "camera.yaml", "rgb.txt", "depth.txt", "masks.txt"}) {
    fs::remove(folder / name, ignored);
  }
  fs::remove(folder, ignored);
}

}  // namespace ipl_slam
