#include "common/options.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "common/nearest_name.hpp"
#include "common/options_value.hpp"

namespace ipl_slam {
namespace {

std::string_view leaf(std::string_view path) {
  return path.substr(path.rfind('.') + 1);
}

}  // namespace

std::string_view Option::name() const {
  return leaf(path);
}

int Option::depth() const {
  return static_cast<int>(std::count(path.begin(), path.end(), '.'));
}

void OptionTable::add_number(const char* name, Option::Target target, const NumberInfo& info) {
  options_.push_back({.path = prefix_ + name,
                      .doc = info.doc,
                      .target = target,
                      .min = info.min,
                      .max = info.max,
                      .unit = info.unit != nullptr ? info.unit : "",
                      .choices = {}});
}

void OptionTable::number(const char* name, int& value, const NumberInfo& info) {
  add_number(name, &value, info);
}
void OptionTable::number(const char* name, unsigned& value, const NumberInfo& info) {
  add_number(name, &value, info);
}
void OptionTable::number(const char* name, std::uint64_t& value, const NumberInfo& info) {
  add_number(name, &value, info);
}
void OptionTable::number(const char* name, float& value, const NumberInfo& info) {
  add_number(name, &value, info);
}
void OptionTable::number(const char* name, double& value, const NumberInfo& info) {
  add_number(name, &value, info);
}

void OptionTable::flag(const char* name, bool& value, const char* doc) {
  options_.push_back({.path = prefix_ + name, .doc = doc, .target = &value, .unit = {}, .choices = {}});
}

void OptionTable::text(const char* name, std::string& value, const char* doc) {
  options_.push_back({.path = prefix_ + name, .doc = doc, .target = &value, .unit = {}, .choices = {}});
}

void OptionTable::choice(const char* name, std::string& value, std::vector<std::string> choices,
                         const char* doc) {
  options_.push_back(
      {.path = prefix_ + name, .doc = doc, .target = &value, .unit = {}, .choices = std::move(choices)});
}

std::string OptionTable::enter_section(const char* name, const char* doc) {
  options_.push_back(
      {.path = prefix_ + name, .doc = doc, .target = std::monostate{}, .unit = {}, .choices = {}});
  std::string outer = prefix_;
  prefix_ += name;
  prefix_ += '.';
  return outer;
}

const Option* OptionTable::find(std::string_view path) const {
  const auto it = std::find_if(options_.begin(), options_.end(),
                               [&](const Option& option) { return option.path == path; });
  return it == options_.end() ? nullptr : &*it;
}

std::string OptionTable::nearest(std::string_view path) const {
  // A key is mistyped or put into the wrong section: the second is told by its last part, at a cost of one
  // letter.
  std::string best;
  std::size_t best_distance = std::numeric_limits<std::size_t>::max();
  for (const Option& option : options_) {
    const std::size_t distance =
        std::min(edit_distance(path, option.path), edit_distance(leaf(path), option.name()) + 1);
    if (distance < best_distance) {
      best_distance = distance;
      best = option.path;
    }
  }
  return best;
}

std::string describe_allowed(const Option& option) {
  if (option.is_section()) return "a section";
  if (std::holds_alternative<bool*>(option.target)) return "true or false";
  if (!option.choices.empty()) return fmt::format("one of: {}", fmt::join(option.choices, ", "));
  if (!detail::is_number(option)) return "a text";

  std::string text = detail::is_whole_number(option) ? "a whole number" : "a number";
  const bool bounded_below = std::isfinite(option.min), bounded_above = std::isfinite(option.max);
  const std::string min = detail::format_limit(option, option.min),
                    max = detail::format_limit(option, option.max);
  if (bounded_below && bounded_above) text += fmt::format(" from {} to {}", min, max);
  if (bounded_below && !bounded_above) text += fmt::format(" of at least {}", min);
  if (!bounded_below && bounded_above) text += fmt::format(" of at most {}", max);
  if (!option.unit.empty()) text += fmt::format(" ({})", option.unit);
  return text;
}

}  // namespace ipl_slam
