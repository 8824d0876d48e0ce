#include "segmentation/class_names.hpp"

#include <algorithm>
#include <charconv>
#include <cstddef>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "common/nearest_name.hpp"

namespace ipl_slam {
namespace {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

/// Takes what a scanner expects off the front of a text; each returns whether it was there.
struct Scanner {
  std::string_view rest;

  void blanks() { rest.remove_prefix(std::min(rest.find_first_not_of(" \t\r\n"), rest.size())); }

  bool character(char expected) {
    blanks();
    if (rest.empty() || rest.front() != expected) return false;
    rest.remove_prefix(1);
    return true;
  }

  bool number(std::size_t& value) {
    blanks();
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    return error == std::errc();
  }

  /// A text as Python prints it: in single or, if it holds one of these, in double quotes; \ before a quote
  /// or another \.
  bool quoted(std::string& value) {
    blanks();
    if (rest.empty() || (rest.front() != '\'' && rest.front() != '"')) return false;
    const char quote = rest.front();
    value.clear();
    for (std::size_t i = 1; i < rest.size(); ++i) {
      if (rest[i] == quote) {
        rest.remove_prefix(i + 1);
        return true;
      }
      if (rest[i] == '\\' && i + 1 < rest.size()) ++i;
      value += rest[i];
    }
    return false;
  }
};

}  // namespace

const std::vector<std::string>& coco_class_names() {
  static const std::vector<std::string> names = {"person",        "bicycle",      "car",
                                                 "motorcycle",    "airplane",     "bus",
                                                 "train",         "truck",        "boat",
                                                 "traffic light", "fire hydrant", "stop sign",
                                                 "parking meter", "bench",        "bird",
                                                 "cat",           "dog",          "horse",
                                                 "sheep",         "cow",          "elephant",
                                                 "bear",          "zebra",        "giraffe",
                                                 "backpack",      "umbrella",     "handbag",
                                                 "tie",           "suitcase",     "frisbee",
                                                 "skis",          "snowboard",    "sports ball",
                                                 "kite",          "baseball bat", "baseball glove",
                                                 "skateboard",    "surfboard",    "tennis racket",
                                                 "bottle",        "wine glass",   "cup",
                                                 "fork",          "knife",        "spoon",
                                                 "bowl",          "banana",       "apple",
                                                 "sandwich",      "orange",       "broccoli",
                                                 "carrot",        "hot dog",      "pizza",
                                                 "donut",         "cake",         "chair",
                                                 "couch",         "potted plant", "bed",
                                                 "dining table",  "toilet",       "tv",
                                                 "laptop",        "mouse",        "remote",
                                                 "keyboard",      "cell phone",   "microwave",
                                                 "oven",          "toaster",      "sink",
                                                 "refrigerator",  "book",         "clock",
                                                 "vase",          "scissors",     "teddy bear",
                                                 "hair drier",    "toothbrush"};
  return names;
}

std::vector<std::string> parse_class_names(std::string_view text) {
  std::vector<std::string> names;
  Scanner scanner{text};
  if (!scanner.character('{')) return {};
  do {
    std::size_t index = 0;
    std::string name;
    if (!scanner.number(index) || index != names.size()) return {};
    if (!scanner.character(':') || !scanner.quoted(name)) return {};
    names.push_back(name);
  } while (scanner.character(','));
  return scanner.character('}') ? names : std::vector<std::string>();
}

std::vector<std::string> class_names(std::string_view metadata, int count) {
  const auto size = static_cast<std::size_t>(count);
  std::vector<std::string> names = parse_class_names(metadata);
  if (names.size() == size) return names;
  if (coco_class_names().size() == size) return coco_class_names();
  names.clear();
  for (int i = 0; i < count; ++i) names.push_back(fmt::format("class {}", i));
  return names;
}

std::vector<bool> select_classes(std::string_view list, const std::vector<std::string>& names) {
  std::vector<bool> selected(names.size(), false);
  bool any = false;
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(','), list.size());
    const std::string_view name = trimmed(list.substr(0, end));
    list.remove_prefix(std::min(end + 1, list.size()));
    if (name.empty()) continue;
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
      throw UserError(
          fmt::format("the model knows no class '{}'; did you mean '{}'?", name, nearest_name(name, names)));
    }
    selected[static_cast<std::size_t>(found - names.begin())] = true;
    any = true;
  }
  return any ? selected : std::vector<bool>(names.size(), true);
}

}  // namespace ipl_slam
