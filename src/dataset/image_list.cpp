#include "dataset/image_list.hpp"

#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "common/text_file.hpp"

namespace ipl_slam {
namespace {

constexpr double kNoTime = -std::numeric_limits<double>::infinity();
constexpr const char* kImageLine = "a line reads \"timestamp file\", e.g. \"12.5 rgb/12.5.png\"";
constexpr const char* kPairLine =
    "a line reads \"timestamp file timestamp file\", e.g. \"12.50 rgb/12.50.png 12.51 depth/12.51.png\"";

[[noreturn]] void fail(const std::filesystem::path& list, const TextLine& line, const char* expected) {
  constexpr std::size_t shown = 60;
  throw UserError(fmt::format("{}:{}: cannot understand '{}{}'; {}", list.string(), line.number,
                              line.text.substr(0, shown), line.text.size() > shown ? "..." : "", expected));
}

std::optional<double> parse_time(std::string_view word) {
  const std::optional<double> time = parse_number(word);
  return time && std::isfinite(*time) ? time : std::nullopt;
}

/// The part of `line` from the word that starts at `from` to the end of the word before `until`, inner blanks
/// kept.
std::string between(const std::vector<std::string_view>& words, std::size_t from, std::size_t until) {
  const char* begin = words[from].data();
  const char* end = words[until - 1].data() + words[until - 1].size();
  return {begin, end};
}

std::optional<ListedImage> parse_image(const std::string& line) {
  const std::vector<std::string_view> words = split_words(line);
  if (words.size() < 2) return std::nullopt;
  const std::optional<double> time = parse_time(words[0]);
  if (!time) return std::nullopt;
  return ListedImage{*time, between(words, 1, words.size())};
}

std::optional<ListedPair> parse_pair(const std::string& line) {
  const std::vector<std::string_view> words = split_words(line);
  if (words.size() < 4) return std::nullopt;
  const std::optional<double> color_time = parse_time(words[0]);
  if (!color_time) return std::nullopt;
  // With blanks in the names, the second timestamp is the one word in between that is a number.
  std::optional<ListedPair> pair;
  for (std::size_t i = 2; i + 1 < words.size(); ++i) {
    const std::optional<double> depth_time = parse_time(words[i]);
    if (!depth_time) continue;
    if (pair) return std::nullopt;
    pair =
        ListedPair{{*color_time, between(words, 1, i)}, {*depth_time, between(words, i + 1, words.size())}};
  }
  return pair;
}

/// Notes the entry as misplaced unless it comes after `latest`, which then moves on.
bool in_order(double timestamp, double& latest, const std::filesystem::path& list, const TextLine& line,
              std::vector<MisplacedEntry>& misplaced) {
  if (timestamp > latest) {
    latest = timestamp;
    return true;
  }
  const bool duplicate = timestamp == latest;
  misplaced.push_back(
      {timestamp, latest, duplicate ? "duplicate timestamp" : "backward timestamp",
       fmt::format("{}:{}: {:.6f} {}", list.string(), line.number, timestamp,
                   duplicate ? "is there already" : fmt::format("comes after {:.6f}", latest))});
  return false;
}

std::vector<TextLine> read_entries(const std::filesystem::path& list, const char* expected) {
  std::vector<TextLine> lines = read_lines(list);
  if (lines.empty()) throw UserError(fmt::format("'{}' lists no image; {}", list.string(), expected));
  return lines;
}

}  // namespace

ImageList read_image_list(const std::filesystem::path& list) {
  ImageList result;
  double latest = kNoTime;
  for (const TextLine& line : read_entries(list, kImageLine)) {
    std::optional<ListedImage> image = parse_image(line.text);
    if (!image) fail(list, line, kImageLine);
    if (in_order(image->timestamp, latest, list, line, result.misplaced))
      result.images.push_back(std::move(*image));
  }
  return result;
}

PairList read_associations(const std::filesystem::path& list) {
  PairList result;
  double latest = kNoTime;
  for (const TextLine& line : read_entries(list, kPairLine)) {
    std::optional<ListedPair> pair = parse_pair(line.text);
    if (!pair) fail(list, line, kPairLine);
    if (in_order(pair->color.timestamp, latest, list, line, result.misplaced)) {
      result.pairs.push_back(std::move(*pair));
    }
  }
  return result;
}

}  // namespace ipl_slam
