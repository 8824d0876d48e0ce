#include <fstream>
#include <iterator>
#include <set>

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

}  // namespace

void read_options_file(const OptionTable& table, const std::filesystem::path& file) {
  const std::string text = read_text(file);
  Reader reader(table, file.string());
  try {
    const std::vector<YAML::Node> documents = YAML::LoadAll(text);
    if (documents.empty()) return;
    if (documents.size() > 1) {
      throw UserError(fmt::format("{}: a second YAML document starts here; put all settings into one",
                                  reader.where(documents[1])));
    }
    const YAML::Node& root = documents[0];
    if (root.IsNull()) return;
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
