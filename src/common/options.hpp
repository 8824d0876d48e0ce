#pragma once

// How settings are declared. Each stage has a plain struct with a default for every field and one visit()
// that names the fields; printing, reading, range checks and documentation all go through it, so no key can
// be forgotten:
//
//   struct OrbOptions {
//     int features = 1000;
//     bool blur = true;
//     std::string detector = "fast";
//     template <class Visitor>
//     void visit(Visitor& v) {
//       v.number("features", features, {.min = 50, .max = 10000, .unit = "count", .doc = "keypoints kept per
//       frame"}); v.flag("blur", blur, "smooth the image before descriptors are taken"); v.choice("detector",
//       detector, {"fast", "agast"}, "corner detector"); v.section("grid", grid, "grid that spreads the
//       keypoints");   // a nested options struct
//     }
//   };
//
// The visitor is always an OptionTable: a flat list of what there is to set, with pointers into the struct.
// All the work is done on that list, in ordinary functions; only the few lines at the end of this file are
// templates.

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace ipl_slam {

/// Limits and documentation of a numeric setting; min and max are allowed values (infinity = no limit).
struct NumberInfo {
  double min;
  double max;
  const char* unit;
  const char* doc;
};

/// One setting, or the head of a section of settings.
struct Option {
  using Target =
      std::variant<std::monostate, int*, unsigned*, std::uint64_t*, float*, double*, bool*, std::string*>;

  std::string path;                  ///< dotted, e.g. "orb.grid.cell_size"
  std::string doc;                   ///< what it means
  Target target;                     ///< the field it stands for; monostate for a section
  double min = 0.0, max = 0.0;       ///< numbers: allowed values
  std::string unit;                  ///< numbers: "m", "pixel", "count", ...
  std::vector<std::string> choices;  ///< texts with a fixed set of values: that set

  [[nodiscard]] bool is_section() const { return target.index() == 0; }
  /// The last part of the path, as it stands in a file.
  [[nodiscard]] std::string_view name() const;
  /// Number of sections it lies in.
  [[nodiscard]] int depth() const;
};

/// The settings of one options struct in order of declaration, sections before what they hold. Points into
/// the struct, which must outlive it. This is the visitor that visit() functions are called with.
class OptionTable {
 public:
  void number(const char* name, int& value, const NumberInfo& info);
  void number(const char* name, unsigned& value, const NumberInfo& info);
  void number(const char* name, std::uint64_t& value, const NumberInfo& info);
  void number(const char* name, float& value, const NumberInfo& info);
  void number(const char* name, double& value, const NumberInfo& info);
  void flag(const char* name, bool& value, const char* doc);
  void text(const char* name, std::string& value, const char* doc);
  void choice(const char* name, std::string& value, std::vector<std::string> choices, const char* doc);
  template <class Nested>
  void section(const char* name, Nested& nested, const char* doc) {
    const std::string outer = enter_section(name, doc);
    nested.visit(*this);
    prefix_ = outer;
  }

  [[nodiscard]] const std::vector<Option>& options() const { return options_; }
  /// The option of a dotted path, or null.
  [[nodiscard]] const Option* find(std::string_view path) const;
  /// The path nearest to a mistyped one, by spelling; empty only for an empty table.
  [[nodiscard]] std::string nearest(std::string_view path) const;

 private:
  void add_number(const char* name, Option::Target target, const NumberInfo& info);
  std::string enter_section(const char* name, const char* doc);

  std::string prefix_;
  std::vector<Option> options_;
};

/// What may be given: "a whole number from 50 to 10000 (count)", "true or false", "one of: fast, agast".
[[nodiscard]] std::string describe_allowed(const Option& option);

/// Reads a YAML file into the fields. Keys stand in sections or dotted ("orb.features: 1200"); keys that are
/// absent keep their values. Throws UserError "FILE:LINE: ..." for an unknown key (with the nearest valid
/// one), a wrong type, a value out of range, a key given twice, anything that is not one map, and broken
/// YAML; then no field has been changed.
void read_options_file(const OptionTable& table, const std::filesystem::path& file);

/// Sets one field from "KEY=VALUE", e.g. "orb.features=1200". Throws UserError as read_options_file does.
void assign_option(const OptionTable& table, std::string_view assignment);

/// Throws UserError naming the first field whose value is out of its range or no valid choice.
void check_option_values(const OptionTable& table);

/// YAML with every key's meaning, unit and range as a comment above it; reading it back gives the same
/// values.
[[nodiscard]] std::string options_yaml(const OptionTable& table);
/// The values alone, nested by section, in order of declaration.
[[nodiscard]] nlohmann::ordered_json options_json(const OptionTable& table);
/// One Markdown table per top-level section: key, default (the present value), unit, allowed values, meaning.
[[nodiscard]] std::string options_markdown(const OptionTable& table);

/// The table of an options struct; valid as long as `options` lives and does not move.
template <class Options>
[[nodiscard]] OptionTable option_table(Options& options) {
  OptionTable table;
  options.visit(table);
  return table;
}

/// See read_options_file.
template <class Options>
void load_options(Options& options, const std::filesystem::path& file) {
  read_options_file(option_table(options), file);
}

/// See assign_option.
template <class Options>
void set_option(Options& options, std::string_view assignment) {
  assign_option(option_table(options), assignment);
}

/// See check_option_values.
template <class Options>
void check_options(Options options) {
  check_option_values(option_table(options));
}

}  // namespace ipl_slam
