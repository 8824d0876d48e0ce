#pragma once

#include <string>
#include <string_view>
#include <variant>

#include "common/options.hpp"

// The parts of the option machinery that only its own source files share.
namespace ipl_slam::detail {

/// A value that was read and found valid, waiting to be written into an option's field: reading is all or
/// nothing.
struct PendingValue {
  const Option* option;
  std::variant<int, unsigned, std::uint64_t, float, double, bool, std::string> value;
};

/// Reads the text of a scalar for an option. `where` ("FILE:LINE") heads the message of the UserError that is
/// thrown where type, range or choice do not fit. `quoted`: the text stood in quotes, so it is a text and
/// nothing else.
[[nodiscard]] PendingValue parse_value(const Option& option, const std::string& text, bool quoted,
                                       std::string_view where);
/// Writes the value into the field.
void commit(const PendingValue& pending);

/// The value of a field as it is written in YAML; numbers so that reading gives the same bits back.
[[nodiscard]] std::string format_value(const Option& option);
/// A number of the declared kind for messages and tables: "1000" for whole numbers, "0.01" or "10.0" for
/// others.
[[nodiscard]] std::string format_limit(const Option& option, double limit);
/// True for int, unsigned and uint64.
[[nodiscard]] bool is_whole_number(const Option& option);
[[nodiscard]] bool is_number(const Option& option);

/// Text between single quotes for a one-line message: shortened, control characters replaced.
[[nodiscard]] std::string quoted_for_message(std::string_view text);

/// Throws UserError: unknown key, with the nearest valid one.
[[noreturn]] void throw_unknown_key(const OptionTable& table, std::string_view path, std::string_view where);

}  // namespace ipl_slam::detail
