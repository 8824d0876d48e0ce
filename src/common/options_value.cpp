#include "common/options_value.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <type_traits>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "common/nearest_name.hpp"

namespace ipl_slam {
namespace detail {
namespace {

// The whole text as a number of type T, or nothing. "1.5" is no int, "12 m" is nothing at all.
template <class T>
std::optional<T> parse_number(std::string_view text) {
  // from_chars takes no plus sign; one is taken off here, but "+-1" stays wrong.
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// YAML spells infinity and not-a-number with a dot.
template <class T>
std::optional<T> parse_real(std::string_view text) {
  if (text == ".inf" || text == "+.inf") return std::numeric_limits<T>::infinity();
  if (text == "-.inf") return -std::numeric_limits<T>::infinity();
  return parse_number<T>(text);
}

template <class T>
bool in_range(const Option& option, T value) {
  const double number = static_cast<double>(value);
  return number >= option.min && number <= option.max;  // false for NaN
}

// A float limit like 0.1 given as a double is not the float 0.1: it is compared as the float that was meant.
template <>
bool in_range(const Option& option, float value) {
  return value >= static_cast<float>(option.min) && value <= static_cast<float>(option.max);
}

template <class T>
std::string format_real(T value) {
  if (std::isinf(value)) return value < 0 ? "-.inf" : ".inf";
  if (std::isnan(value)) return ".nan";
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

bool is_plain_word(const std::string& text) {
  static constexpr std::string_view kSpecial[] = {"true", "false", "null", "yes", "no", "on", "off"};
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  const auto is_word = [&](char c) { return is_letter(c) || (c >= '0' && c <= '9') || c == '-'; };
  return !text.empty() && is_letter(text[0]) && std::all_of(text.begin(), text.end(), is_word) &&
         std::none_of(std::begin(kSpecial), std::end(kSpecial),
                      [&](std::string_view word) { return edit_distance(word, text) == 0; });
}

std::string yaml_text(const std::string& text) {
  if (is_plain_word(text)) return text;
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (c == '\n') {
      out += "\\n";
    } else if (c == '\t') {
      out += "\\t";
    } else if (static_cast<unsigned char>(c) < 0x20) {
      out += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    } else {
      out += c;
    }
  }
  return out + '"';
}

}  // namespace

bool is_whole_number(const Option& option) {
  return std::holds_alternative<int*>(option.target) || std::holds_alternative<unsigned*>(option.target) ||
         std::holds_alternative<std::uint64_t*>(option.target);
}

bool is_number(const Option& option) {
  return is_whole_number(option) || std::holds_alternative<float*>(option.target) ||
         std::holds_alternative<double*>(option.target);
}

std::string format_limit(const Option& option, double limit) {
  if (is_whole_number(option)) return fmt::format("{:.0f}", limit);
  return format_real(limit);
}

std::string quoted_for_message(std::string_view text) {
  constexpr std::size_t kLongest = 60;
  std::string out(text.substr(0, kLongest));
  for (char& c : out) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  }
  return fmt::format("'{}{}'", out, text.size() > kLongest ? "..." : "");
}

void throw_unknown_key(const OptionTable& table, std::string_view path, std::string_view where) {
  throw UserError(fmt::format("{}: unknown key {}; did you mean '{}'?", where, quoted_for_message(path),
                              table.nearest(path)));
}

PendingValue parse_value(const Option& option, const std::string& text, bool quoted, std::string_view where) {
  const auto refuse = [&](const std::string& hint = {}) {
    throw UserError(fmt::format("{}: '{}' must be {}, not {}{}", where, option.path, describe_allowed(option),
                                quoted_for_message(text), hint));
  };
  PendingValue pending{&option, {}};
  const auto read = [&](auto* field) {
    using T = std::remove_pointer_t<decltype(field)>;
    if constexpr (std::is_same_v<T, std::string>) {
      const auto& choices = option.choices;
      if (!choices.empty() && std::find(choices.begin(), choices.end(), text) == choices.end()) {
        refuse(fmt::format("; did you mean '{}'?", nearest_name(text, choices)));
      }
      pending.value = text;
    } else if constexpr (std::is_same_v<T, bool>) {
      if (quoted || (text != "true" && text != "false")) refuse();
      pending.value = text == "true";
    } else if constexpr (!std::is_same_v<T, const std::monostate>) {
      const auto number = [&] {
        if constexpr (std::is_floating_point_v<T>) return parse_real<T>(text);
        // The else keeps from_chars for whole numbers from being compiled for reals and the other way round.
        else
          return parse_number<T>(text);
      }();
      if (quoted) refuse(" in quotes");
      if (!number || !in_range(option, *number)) refuse();
      pending.value = *number;
    }
  };
  std::visit(
      [&](auto target) {
        if constexpr (std::is_pointer_v<decltype(target)>) read(target);
      },
      option.target);
  return pending;
}

void commit(const PendingValue& pending) {
  std::visit(
      [&](auto target) {
        if constexpr (std::is_pointer_v<decltype(target)>) {
          *target = std::get<std::remove_pointer_t<decltype(target)>>(pending.value);
        }
      },
      pending.option->target);
}

std::string format_value(const Option& option) {
  return std::visit(
      [](auto target) -> std::string {
        using T = decltype(target);
        if constexpr (std::is_same_v<T, std::monostate>) {
          return {};
        } else if constexpr (std::is_same_v<T, std::string*>) {
          return yaml_text(*target);
        } else if constexpr (std::is_floating_point_v<std::remove_pointer_t<T>>) {
          return format_real(*target);
        } else {
          return fmt::format("{}", *target);
        }
      },
      option.target);
}

}  // namespace detail

void assign_option(const OptionTable& table, std::string_view assignment) {
  const std::string where = fmt::format("setting {}", detail::quoted_for_message(assignment));
  const std::size_t equals = assignment.find('=');
  if (equals == std::string_view::npos || equals == 0) {
    throw UserError(fmt::format("{}: must have the form KEY=VALUE, e.g. '{}'", where,
                                table.options().empty() ? "key=1" : table.options().back().path + "=..."));
  }
  const std::string_view path = assignment.substr(0, equals);
  const Option* option = table.find(path);
  if (option == nullptr) detail::throw_unknown_key(table, path, where);
  if (option->is_section()) {
    throw UserError(fmt::format("{}: '{}' is a section; set one of the keys in it", where, path));
  }
  detail::commit(detail::parse_value(*option, std::string(assignment.substr(equals + 1)), false, where));
}

void check_option_values(const OptionTable& table) {
  for (const Option& option : table.options()) {
    if (option.is_section()) continue;
    // A text field's value is its own spelling; for the others reading back what would be printed is the same
    // check.
    const auto* const* text = std::get_if<std::string*>(&option.target);
    (void)detail::parse_value(option, text != nullptr ? **text : detail::format_value(option), false,
                              "settings");
  }
}

}  // namespace ipl_slam
