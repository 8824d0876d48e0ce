#include "dataset/synthetic/write_sequence.hpp"

#include <cstdint>
#include <fstream>
#include <mutex>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include <ipl_slam/error.hpp>

#include "dataset/camera_config.hpp"
#include "dataset/synthetic/parallel_loop.hpp"

namespace ipl_slam {
namespace {

namespace fs = std::filesystem;

// First words of the file lists; a folder whose rgb.txt starts with them may be overwritten.
constexpr const char* kMark = "# rendered by ipl_slam synth";

void write_file(const fs::path& file, const char* data, std::size_t size) {
  std::ofstream out(file, std::ios::binary);
  out.write(data, static_cast<std::streamsize>(size));
  out.close();
  if (!out) {
    throw UserError(fmt::format("{}: cannot be written; check permissions and free space", file.string()));
  }
}

void write_text(const fs::path& file, const std::string& text) {
  write_file(file, text.data(), text.size());
}

// Encoded in memory first: OpenCV does not report a disk that fills up.
void write_png(const fs::path& file, const cv::Mat& image) {
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_COMPRESSION, 1})) {
    throw std::runtime_error("cannot encode " + file.string());
  }
  write_file(file, reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

std::string frame_name(const SyntheticSource& source, std::size_t frame) {
  return fmt::format("{:013.6f}", source.timestamp(frame));  // leading zeros: names sort by time
}

std::string list_of(const SyntheticSource& source, const char* folder, const std::string& made_by) {
  std::string text = fmt::format("{}: {}\n# timestamp filename\n", kMark, made_by);
  for (std::size_t i = 0; i < source.size(); ++i) {
    const std::string name = frame_name(source, i);
    text += fmt::format("{} {}/{}.png\n", name, folder, name);
  }
  return text;
}

std::string associations(const SyntheticSource& source) {
  std::string text;
  for (std::size_t i = 0; i < source.size(); ++i) {
    const std::string name = frame_name(source, i);
    text += fmt::format("{0} rgb/{0}.png {0} depth/{0}.png\n", name);
  }
  return text;
}

std::string ground_truth(const SyntheticSource& source) {
  std::string text = "# timestamp tx ty tz qx qy qz qw\n";
  for (std::size_t i = 0; i < source.size(); ++i) {
    const SE3 T_wc = source.T_wc(i);
    const Eigen::Vector3d& t = T_wc.translation();
    const Eigen::Quaterniond& q = T_wc.rotation();
    text += fmt::format("{} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", frame_name(source, i), t.x(),
                        t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

std::string objects_json(const SyntheticSource& source) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const SyntheticObject& object : source.objects()) {
    nlohmann::ordered_json entry;
    entry["id"] = object.id;
    entry["class"] = object.class_name;
    entry["moving"] = object.moving;
    entry["moving_frames"] = object.moving_frames;
    list.push_back(std::move(entry));
  }
  return list.dump(1) + "\n";
}

void refuse_what_is_not_ours(const fs::path& folder, bool overwrite) {
  if (!fs::exists(fs::symlink_status(folder))) return;
  if (!overwrite) {
    throw UserError(
        fmt::format("{}: exists already; give another folder or --force to replace it", folder.string()));
  }
  if (fs::is_directory(folder) && fs::is_empty(folder)) return;
  std::string line;
  std::getline(std::ifstream(folder / "rgb.txt") >> std::ws, line);
  if (line.rfind(kMark, 0) != 0) {
    throw UserError(
        fmt::format("{}: is no rendered sequence and is not replaced; give another folder", folder.string()));
  }
}

void write_all(const SyntheticSource& source, const fs::path& folder, const SequenceWriteOptions& options) {
  for (const char* part : {"rgb", "depth", "masks"}) fs::create_directories(folder / part);
  std::mutex done_mutex;
  synthetic::parallel_loop(source.size(), options.threads, [&](std::size_t i) {
    const SyntheticFrame frame = source.render(i);
    const std::string name = frame_name(source, i) + ".png";
    write_png(folder / "rgb" / name, frame.rgbd.color);
    write_png(folder / "depth" / name, frame.rgbd.depth);
    write_png(folder / "masks" / name, frame.mask);
    if (!options.frame_done) return;
    const std::lock_guard lock(done_mutex);
    options.frame_done();
  });
  write_text(folder / "rgb.txt", list_of(source, "rgb", options.made_by));
  write_text(folder / "depth.txt", list_of(source, "depth", options.made_by));
  write_text(folder / "masks.txt", list_of(source, "masks", options.made_by));
  write_text(folder / "associations.txt", associations(source));
  write_text(folder / "groundtruth.txt", ground_truth(source));
  write_text(folder / "camera.yaml", camera_yaml(source.camera()));
  write_text(folder / "objects.json", objects_json(source));
}

}  // namespace

void write_sequence(const SyntheticSource& source, const fs::path& folder,
                    const SequenceWriteOptions& options) {
  // A trailing slash would make the name empty.
  fs::path target = fs::absolute(folder).lexically_normal();
  if (target.filename().empty()) target = target.parent_path();
  const fs::path beside = target.parent_path() / fmt::format(".{}.partial", target.filename().string());
  try {
    refuse_what_is_not_ours(target, options.overwrite);
    fs::remove_all(beside);
    fs::create_directories(beside);
    write_all(source, beside, options);
    fs::remove_all(target);
    fs::rename(beside, target);
  } catch (const fs::filesystem_error& error) {
    std::error_code ignored;
    fs::remove_all(beside, ignored);
    throw UserError(fmt::format("{}: cannot be written ({}); check permissions and free space",
                                target.string(), error.code().message()));
  } catch (...) {
    std::error_code ignored;
    fs::remove_all(beside, ignored);
    throw;
  }
}

}  // namespace ipl_slam
