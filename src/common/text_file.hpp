#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ipl_slam {

/// A line of a text file that carries data.
struct TextLine {
  std::size_t number = 0;  ///< in the file, from 1
  std::string text;        ///< without line end and surrounding blanks, never empty
};

/// The bytes of a file, all or the first so many. Throws UserError when it is missing, a folder, or cannot be
/// read.
[[nodiscard]] std::string read_file(const std::filesystem::path& file,
                                    std::size_t most = std::numeric_limits<std::size_t>::max());

/// The lines of a text file that are neither blank nor comments ('#' first). Unix and Windows line ends and a
/// UTF-8 byte order mark are understood. Throws UserError as read_file does.
[[nodiscard]] std::vector<TextLine> read_lines(const std::filesystem::path& file);

/// The words of a line; blanks, tabs and commas separate them. The views point into `line`.
[[nodiscard]] std::vector<std::string_view> split_words(std::string_view line);

/// A word that is a number as a whole, in the C locale whatever the program's locale is; "nan" and "inf" are
/// numbers.
[[nodiscard]] std::optional<double> parse_number(std::string_view word);

}  // namespace ipl_slam
