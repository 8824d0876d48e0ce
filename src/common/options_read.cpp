#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <string>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <ipl_slam/error.hpp>

#include "common/options.hpp"
#include "common/options_value.hpp"

namespace ipl_slam {
namespace {

std::string read_text(const std::filesystem::path& file) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error)) {
    throw UserError(fmt::format("{}: is a folder; give a YAML file with settings", file.string()));
  }
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    throw UserError(fmt::format("{}: cannot be read; check that the settings file exists and may be read",
                                file.string()));
  }
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

// Walks the YAML tree along the table and gathers the values; nothing is written before all of it was found
// right.
class Reader {
 public:
  Reader(const OptionTable& table, std::string file) : table_(table), file_(std::move(file)) {}

  void read_map(const YAML::Node& map, const std::string& prefix) {
    for (const auto& entry : map) {
      if (!entry.first.IsScalar()) {
        throw UserError(fmt::format("{}: a key must be a plain name", where(entry.first)));
      }
      const std::string path = prefix + entry.first.Scalar();
      const Option* option = table_.find(path);
      if (option == nullptr) detail::throw_unknown_key(table_, path, where(entry.first));
      if (!seen_.insert(path).second) {
        throw UserError(
            fmt::format("{}: key '{}' is given twice; keep one of them", where(entry.first), path));
      }
      if (option->is_section()) {
        read_section(*option, entry.first, entry.second);
      } else {
        read_value(*option, entry.first, entry.second);
      }
    }
  }

  void commit() const {
    for (const detail::PendingValue& value : pending_) detail::commit(value);
  }

  [[nodiscard]] std::string where(const YAML::Node& node) const {
    return fmt::format("{}:{}", file_, node.Mark().line + 1);
  }

 private:
  void read_section(const Option& option, const YAML::Node& key, const YAML::Node& value) {
    if (value.IsNull()) return;  // a section whose keys are all commented out
    if (!value.IsMap()) {
      throw UserError(fmt::format("{}: '{}' must be a section with keys of its own, not {}", where(key),
                                  option.path, describe(value)));
    }
    read_map(value, option.path + ".");
  }

  void read_value(const Option& option, const YAML::Node& key, const YAML::Node& value) {
    if (!value.IsScalar()) {
      throw UserError(fmt::format("{}: '{}' must be {}, not {}", where(key), option.path,
                                  describe_allowed(option), describe(value)));
    }
    // yaml-cpp tags what stands in quotes or in a block with "!".
    pending_.push_back(detail::parse_value(option, value.Scalar(), value.Tag() == "!", where(value)));
  }

  static std::string describe(const YAML::Node& value) {
    if (value.IsNull()) return "nothing";
    if (value.IsMap()) return "a section";
    if (value.IsSequence()) return "a list";
    return detail::quoted_for_message(value.Scalar());
  }

  const OptionTable& table_;
  std::string file_;
  std::set<std::string> seen_;
  std::vector<detail::PendingValue> pending_;
};

// Whether a file holds comments and marks of documents at most. (The library takes some broken ones for
// empty.)
bool says_nothing(const std::string& text) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const auto first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#' || line[0] == '%') continue;
    const std::string word = line.substr(first, line.find_last_not_of(" \t\r") + 1 - first);
    if (word != "---" && word != "..." && word != "~" && word != "null") return false;
  }
  return true;
}

// The line on which a second document starts; 0 = none does. Found by its mark, as YAML::LoadAll never ends
// where a document is broken.
int second_document(const std::string& text) {
  std::istringstream lines(text);
  std::string line;
  bool content = false, ended = false;
  for (int number = 1; std::getline(lines, line); ++number) {
    const auto is_mark = [&](const char* mark) {
      return line.starts_with(mark) && (line.size() == 3 || line.find_first_of(" \t\r", 3) == 3);
    };
    const bool starts = is_mark("---"), ends = is_mark("...");
    const auto first = line.find_first_not_of(" \t\r");
    const bool says_something = !ends && first != std::string::npos && line[first] != '#' && line[0] != '%' &&
                                (!starts || line.size() > 4);
    if (content && (starts || (ended && says_something))) return starts ? number + 1 : number;
    content = content || says_something;
    ended = ended || (content && ends);
  }
  return 0;
}

}  // namespace

void read_options_file(const OptionTable& table, const std::filesystem::path& file) {
  const std::string text = read_text(file);
  Reader reader(table, file.string());
  try {
    if (const int line = second_document(text); line > 0) {
      throw UserError(fmt::format("{}:{}: a second YAML document starts here; put all settings into one",
                                  file.string(), line));
    }
    const YAML::Node root = YAML::Load(text);
    if (root.IsNull() && says_nothing(text)) return;
    if (!root.IsMap()) {
      throw UserError(fmt::format("{}: settings must be lines of the form 'key: value'", reader.where(root)));
    }
    reader.read_map(root, "");
  } catch (const YAML::Exception& error) {
    throw UserError(
        fmt::format("{}:{}: is not valid YAML: {}", file.string(), error.mark.line + 1, error.msg));
  }
  reader.commit();
}

}  // namespace ipl_slam
