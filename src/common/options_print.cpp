#include <type_traits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "common/options.hpp"
#include "common/options_value.hpp"

namespace ipl_slam {
namespace {

constexpr std::size_t kLineWidth = 100;

// `text` as comment lines of bounded width.
std::string comment(std::string_view text, const std::string& indent) {
  std::string out, line = indent + "#";
  while (!text.empty()) {
    const std::string_view word = text.substr(0, text.find(' '));
    text.remove_prefix(std::min(text.size(), word.size() + 1));
    if (line.size() + 1 + word.size() > kLineWidth && line.size() > indent.size() + 1) {
      out += line + '\n';
      line = indent + "#";
    }
    line += ' ';
    line += word;
  }
  return out + line + '\n';
}

std::string markdown_cell(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '|') out += '\\';
    out += c;
  }
  return out;
}

nlohmann::ordered_json json_value(const Option& option) {
  return std::visit(
      [](auto target) -> nlohmann::ordered_json {
        if constexpr (std::is_pointer_v<decltype(target)>) {
          return *target;
        } else {
          return nlohmann::ordered_json::object();
        }
      },
      option.target);
}

// The allowed values without the unit, which has its own column.
std::string markdown_allowed(Option option) {
  option.unit.clear();
  return describe_allowed(option);
}

}  // namespace

std::string options_yaml(const OptionTable& table) {
  std::string out;
  for (const Option& option : table.options()) {
    const std::string indent(2 * static_cast<std::size_t>(option.depth()), ' ');
    if (option.is_section()) {
      if (!out.empty()) out += '\n';
      out += comment(option.doc, indent);
      out += fmt::format("{}{}:\n", indent, option.name());
    } else {
      out += comment(fmt::format("{}: {}", option.doc, describe_allowed(option)), indent);
      out += fmt::format("{}{}: {}\n", indent, option.name(), detail::format_value(option));
    }
  }
  return out;
}

nlohmann::ordered_json options_json(const OptionTable& table) {
  auto root = nlohmann::ordered_json::object();
  for (const Option& option : table.options()) {
    nlohmann::ordered_json* node = &root;
    std::string_view rest = option.path;
    while (true) {
      const std::size_t dot = rest.find('.');
      node = &(*node)[std::string(rest.substr(0, dot))];
      if (dot == std::string_view::npos) break;
      rest.remove_prefix(dot + 1);
    }
    *node = json_value(option);
  }
  return root;
}

std::string options_markdown(const OptionTable& table) {
  const std::string head = "\n| key | default | unit | allowed | meaning |\n|---|---|---|---|---|\n";
  std::string out;
  bool in_table = false;
  for (const Option& option : table.options()) {
    if (option.is_section() && option.depth() == 0) {
      out += fmt::format("{}## {}\n\n{}\n", out.empty() ? "" : "\n", option.path, option.doc);
      in_table = false;
    }
    if (!in_table && !(option.is_section() && option.depth() == 0)) {
      out += head;
      in_table = true;
    }
    if (option.is_section() && option.depth() > 0) {
      out += fmt::format("| **`{}`** | | | | {} |\n", option.path, markdown_cell(option.doc));
    } else if (!option.is_section()) {
      out += fmt::format("| `{}` | {} | {} | {} | {} |\n", option.path,
                         markdown_cell(detail::format_value(option)), markdown_cell(option.unit),
                         markdown_cell(markdown_allowed(option)), markdown_cell(option.doc));
    }
  }
  return out;
}

}  // namespace ipl_slam
