#include "dense/legend_line.hpp"

#include <limits>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "common/text_file.hpp"

namespace ipl_slam {
namespace {

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  const auto is_blank = [](char c) { return static_cast<unsigned char>(c) <= ' '; };
  for (std::size_t begin = 0, end; begin < text.size(); begin = end) {
    while (begin < text.size() && is_blank(text[begin])) ++begin;
    end = begin;
    while (end < text.size() && !is_blank(text[end])) ++end;
    if (end > begin) words.push_back(text.substr(begin, end - begin));
  }
  return words;
}

std::optional<std::int32_t> whole_number(std::string_view word, double most) {
  const std::optional<double> value = parse_number(word);
  if (!value || !(*value >= 0.0 && *value <= most)) return std::nullopt;
  return static_cast<std::int32_t>(*value);
}

}  // namespace

std::string legend_line(const CloudClass& c) {
  return fmt::format("label {} {} {} {} {}", c.label, fmt::join(words_of(c.name), " "), c.color[0],
                     c.color[1], c.color[2]);
}

std::optional<CloudClass> parse_legend_line(std::string_view text) {
  const std::vector<std::string_view> words = words_of(text);
  if (words.size() < 5 || words.front() != "label") return std::nullopt;
  const auto label = whole_number(words[1], std::numeric_limits<std::int32_t>::max());
  if (!label) return std::nullopt;
  CloudClass result;
  result.label = *label;
  const std::size_t colors = words.size() - 3;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto channel = whole_number(words[colors + i], 255);
    if (!channel) return std::nullopt;
    result.color[i] = static_cast<std::uint8_t>(*channel);
  }
  result.name =
      fmt::format("{}", fmt::join(words.begin() + 2, words.begin() + static_cast<long>(colors), " "));
  return result;
}

}  // namespace ipl_slam
