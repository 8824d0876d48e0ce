#include "dataset/camera_config.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <yaml-cpp/yaml.h>

#include <ipl_slam/error.hpp>

#include "common/nearest_name.hpp"
#include "common/text_file.hpp"

namespace ipl_slam {
namespace {

namespace fs = std::filesystem;

/// Published calibrations; depth as 16-bit PNG with 5000 units a metre, images of 640x480.
const std::array<Camera, 4>& preset_cameras() {
  static const std::array<Camera, 4> cameras = {{
      {"tum1", 640, 480, 517.306408, 516.469215, 318.643040, 255.313989,  //
       0.262383, -0.953104, -0.005358, 0.002628, 1.163314, 5000.0},
      {"tum2", 640, 480, 520.908620, 521.007327, 325.141442, 249.701764,  //
       0.231222, -0.784899, -0.003257, -0.000105, 0.917205, 5000.0},
      {"tum3", 640, 480, 535.4, 539.2, 320.1, 247.6, 0.0, 0.0, 0.0, 0.0, 0.0, 5000.0},
      {"bonn", 640, 480, 542.822841, 542.576870, 315.593520, 237.756098,  //
       0.039903, -0.099343, -0.000730, -0.000144, 0.0, 5000.0},
  }};
  return cameras;
}

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// One camera file while it is read: which keys it has, and where an error stands.
class CameraFile {
 public:
  explicit CameraFile(fs::path file) : file_(std::move(file)) {
    camera_.name = file_.stem().string();
    camera_.k1 = camera_.k2 = camera_.p1 = camera_.p2 = camera_.k3 = 0.0;
  }

  Camera read() {
    const YAML::Node root = parse();
    for (const auto& entry : root) read_entry(entry.first, entry.second);
    for (const std::string& key : required_) {
      if (!seen(key))
        throw UserError(fmt::format("{}: the key '{}' is missing; add it", file_.string(), key));
    }
    try {
      camera_.check();
    } catch (const UserError& error) {
      throw UserError(fmt::format("{}: {}", file_.string(), error.what()));
    }
    return camera_;
  }

 private:
  YAML::Node parse() {
    YAML::Node root;
    try {
      root = YAML::Load(read_file(file_));
    } catch (const YAML::Exception& error) {
      fail(error.mark, fmt::format("this is no YAML: {}", error.msg));
    }
    if (!root.IsMap()) fail(root.Mark(), "a camera file holds lines \"key: value\", e.g. \"fx: 525.0\"");
    return root;
  }

  void read_entry(const YAML::Node& key_node, const YAML::Node& value) {
    if (!key_node.IsScalar()) fail(key_node.Mark(), "a key is a plain word such as fx");
    const std::string& key = key_node.Scalar();
    if (std::find(keys_.begin(), keys_.end(), key) == keys_.end()) {
      fail(key_node.Mark(),
           fmt::format("unknown key '{}'; did you mean '{}'?", key, nearest_name(key, keys_)));
    }
    if (seen(key)) fail(key_node.Mark(), fmt::format("the key '{}' is given twice; remove one", key));
    seen_.push_back(key);
    if (key == "name") {
      if (!value.IsScalar()) fail(value.Mark(), "'name' is a word");
      camera_.name = value.Scalar();
    } else if (key == "width" || key == "height") {
      (key == "width" ? camera_.width : camera_.height) = pixels(key, value);
    } else {
      field(key) = number(key, value);
    }
  }

  double& field(const std::string& key) {
    if (key == "fx") return camera_.fx;
    if (key == "fy") return camera_.fy;
    if (key == "cx") return camera_.cx;
    if (key == "cy") return camera_.cy;
    if (key == "k1") return camera_.k1;
    if (key == "k2") return camera_.k2;
    if (key == "p1") return camera_.p1;
    if (key == "p2") return camera_.p2;
    if (key == "k3") return camera_.k3;
    return camera_.depth_scale;
  }

  double number(const std::string& key, const YAML::Node& value) const {
    const std::optional<double> number = value.IsScalar() ? parse_number(value.Scalar()) : std::nullopt;
    if (!number || !std::isfinite(*number)) {
      fail(value.Mark(), fmt::format("'{}' is a number, not {}", key, shown(value)));
    }
    return *number;
  }

  int pixels(const std::string& key, const YAML::Node& value) const {
    constexpr double largest = 1e6;  // far beyond any camera, and well inside int
    const double pixels = number(key, value);
    if (pixels != std::floor(pixels) || std::abs(pixels) > largest) {
      fail(value.Mark(), fmt::format("'{}' is a whole number of pixels, not {}", key, shown(value)));
    }
    return static_cast<int>(pixels);
  }

  static std::string shown(const YAML::Node& value) {
    if (value.IsNull()) return "empty";
    return value.IsScalar() ? fmt::format("'{:.40}'", value.Scalar()) : "a list or map";
  }

  bool seen(const std::string& key) const {
    return std::find(seen_.begin(), seen_.end(), key) != seen_.end();
  }

  [[noreturn]] void fail(const YAML::Mark& mark, const std::string& what) const {
    throw UserError(fmt::format("{}:{}: {}", file_.string(), std::max(mark.line, 0) + 1, what));
  }

  const std::vector<std::string> required_ = {"width", "height", "fx", "fy", "cx", "cy", "depth_scale"};
  const std::vector<std::string> keys_ = {"name", "width", "height", "fx", "fy", "cx",         "cy",
                                          "k1",   "k2",    "p1",     "p2", "k3", "depth_scale"};
  fs::path file_;
  Camera camera_;
  std::vector<std::string> seen_;
};

std::optional<std::string> preset_in_name(const std::string& folder_name) {
  const std::string name = lower_case(folder_name);
  const auto holds = [&name](const char* word) { return name.find(word) != std::string::npos; };
  if (holds("bonn")) return "bonn";
  for (const char digit : {'1', '2', '3'}) {
    if (name.find(std::string("freiburg") + digit) != std::string::npos) return std::string("tum") + digit;
  }
  // "fr1" is short enough to stand in other words: it must start a word, and no digit may follow.
  for (std::size_t at = name.find("fr"); at != std::string::npos; at = name.find("fr", at + 1)) {
    const bool starts_word = at == 0 || !std::isalnum(static_cast<unsigned char>(name[at - 1]));
    const char digit = at + 2 < name.size() ? name[at + 2] : '\0';
    const bool ends = at + 3 >= name.size() || !std::isdigit(static_cast<unsigned char>(name[at + 3]));
    if (starts_word && ends && digit >= '1' && digit <= '3') return std::string("tum") + digit;
  }
  return std::nullopt;
}

}  // namespace

const std::vector<std::string>& camera_presets() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> result;
    for (const Camera& camera : preset_cameras()) result.push_back(camera.name);
    return result;
  }();
  return names;
}

Camera load_camera(const std::string& name_or_file) {
  for (const Camera& camera : preset_cameras()) {
    if (camera.name == lower_case(name_or_file)) return camera;
  }
  std::error_code error;
  const fs::path file = name_or_file;
  if (!fs::exists(file, error) && !file.has_extension() && !file.has_parent_path()) {
    throw UserError(fmt::format("unknown camera '{}'; did you mean '{}'? Give one of {}, or a YAML file",
                                name_or_file, nearest_name(name_or_file, camera_presets()),
                                fmt::join(camera_presets(), ", ")));
  }
  return CameraFile(file).read();
}

std::string camera_yaml(const Camera& c) {
  return fmt::format(
      "name: {}\nwidth: {}\nheight: {}\nfx: {}\nfy: {}\ncx: {}\ncy: {}\nk1: {}\nk2: {}\np1: {}\np2: {}\nk3: "
      "{}\n"
      "depth_scale: {}\n",
      nlohmann::json(c.name).dump(), c.width, c.height, c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3,
      c.depth_scale);
}

std::optional<std::string> guess_camera(const fs::path& folder) {
  std::error_code error;
  const fs::path file = folder / "camera.yaml";
  if (fs::is_regular_file(file, error)) return file.string();
  // Absolute and without a trailing slash, so that "." and "fr1_desk/" have a name.
  fs::path place = fs::weakly_canonical(folder, error);
  if (error) place = folder;
  if (const auto preset = preset_in_name(place.filename().string())) return preset;
  return preset_in_name(place.parent_path().filename().string());
}

}  // namespace ipl_slam
