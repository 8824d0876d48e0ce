#include "common/text_file.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <memory>
#include <system_error>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

namespace ipl_slam {
namespace {

constexpr std::string_view kSeparators = " \t,\r\v\f";
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr std::size_t kReadChunk = 1 << 16;

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& why) {
  throw UserError(fmt::format("cannot read '{}': {}", file.string(), why));
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view blanks = " \t\r\v\f";
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

}  // namespace

std::string read_file(const std::filesystem::path& file, std::size_t most) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error)) fail(file, "it is a folder; give the name of a file");
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> input(std::fopen(file.c_str(), "rb"), &std::fclose);
  if (!input) {
    if (errno == ENOENT || errno == ENOTDIR) fail(file, "no such file; check the path");
    fail(file, std::generic_category().message(errno) + "; check the path and its permissions");
  }
  std::string content;
  std::size_t size = 0, read = 0;
  do {
    const std::size_t wanted = std::min(kReadChunk, most - size);
    content.resize(size + wanted);
    read = std::fread(content.data() + size, 1, wanted, input.get());
    size += read;
  } while (read > 0);
  if (std::ferror(input.get()) != 0) fail(file, std::generic_category().message(errno) + "; check the disk");
  content.resize(size);
  return content;
}

std::vector<TextLine> read_lines(const std::filesystem::path& file) {
  const std::string content = read_file(file);
  std::string_view rest = content;
  if (rest.substr(0, kByteOrderMark.size()) == kByteOrderMark) rest.remove_prefix(kByteOrderMark.size());
  std::vector<TextLine> lines;
  for (std::size_t number = 1; !rest.empty(); ++number) {
    const std::size_t end = rest.find('\n');
    const std::string_view text = trimmed(rest.substr(0, end));
    if (!text.empty() && text.front() != '#') lines.push_back({number, std::string(text)});
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  }
  return lines;
}

std::vector<std::string_view> split_words(std::string_view line) {
  std::vector<std::string_view> words;
  std::size_t begin = line.find_first_not_of(kSeparators);
  while (begin != std::string_view::npos) {
    const std::size_t end = line.find_first_of(kSeparators, begin);
    words.push_back(line.substr(begin, end == std::string_view::npos ? end : end - begin));
    begin = end == std::string_view::npos ? end : line.find_first_not_of(kSeparators, end);
  }
  return words;
}

std::optional<double> parse_number(std::string_view word) {
  if (word.size() > 1 && word.front() == '+' && word[1] != '-') word.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return value;
}

}  // namespace ipl_slam
