#include "evaluation/table.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace ipl_slam {
namespace {

using Json = nlohmann::ordered_json;

std::string number(double value, int decimals) {
  return decimals == TableColumn::kThreeDigits ? fmt::format("{:.3g}", value)
                                               : fmt::format("{:.{}f}", value, decimals);
}

// What would end a cell or a row.
std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '|') result += '\\';
    result += c == '\n' ? ' ' : c;
  }
  return result;
}

std::string markdown_cell(const TableCell& cell, const TableColumn& column) {
  std::string text;
  if (cell.value) text = number(*cell.value, column.decimals);
  if (cell.value && cell.std) text += fmt::format(" ± {}", number(*cell.std, column.decimals));
  if (cell.bold) text = fmt::format("**{}**", text);
  if (!cell.text.empty() && !text.empty()) text += ' ';
  text += escaped(cell.text);
  return text.empty() ? "–" : text;
}

bool names_systems(const Table& table) {
  return std::any_of(table.rows.begin(), table.rows.end(),
                     [](const TableRow& row) { return !row.system.empty(); });
}

std::string markdown_rows(const Table& table) {
  const bool systems = names_systems(table);
  std::string head = systems ? "| Sequence | System |" : "| Sequence |",
              rule = systems ? "|---|---|" : "|---|";
  for (const TableColumn& column : table.columns) {
    head +=
        fmt::format(" {}{} |", column.title, column.unit.empty() ? "" : fmt::format(" [{}]", column.unit));
    rule += "---:|";
  }
  std::string text = head + '\n' + rule + '\n';
  std::string previous;  // a sequence is named in its first row only
  for (const TableRow& row : table.rows) {
    const bool named = systems && row.sequence == previous;
    text += fmt::format("| {} |", named ? "" : escaped(row.sequence));
    previous = row.sequence;
    if (systems) text += fmt::format(" {} |", escaped(row.system));
    for (std::size_t i = 0; i < row.cells.size(); ++i) {
      text += fmt::format(" {} |", markdown_cell(row.cells[i], table.columns[i]));
    }
    text += '\n';
  }
  return text;
}

// RFC 4180.
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::string csv_number(const std::optional<double>& value) {
  return value ? fmt::format("{:.9g}", *value) : "";
}

Json cell_json(const TableCell& cell) {
  return {{"value", cell.value ? Json(*cell.value) : Json()},
          {"std", cell.std ? Json(*cell.std) : Json()},
          {"text", cell.text.empty() ? Json() : Json(cell.text)},
          {"bold", cell.bold}};
}

Json table_json(const Table& table) {
  Json columns = Json::array(), rows = Json::array();
  for (const TableColumn& c : table.columns) columns.push_back({{"title", c.title}, {"unit", c.unit}});
  for (const TableRow& row : table.rows) {
    Json cells = Json::array();
    for (const TableCell& cell : row.cells) cells.push_back(cell_json(cell));
    rows.push_back({{"sequence", row.sequence}, {"system", row.system}, {"cells", std::move(cells)}});
  }
  return {{"id", table.id},
          {"title", table.title},
          {"note", table.note},
          {"columns", std::move(columns)},
          {"rows", std::move(rows)}};
}

}  // namespace

std::string tables_markdown(std::span<const Table> tables) {
  std::string text;
  for (const Table& table : tables) {
    if (!text.empty()) text += '\n';
    text += "## " + table.title + "\n\n";
    if (!table.rows.empty()) text += markdown_rows(table) + '\n';
    if (!table.note.empty()) text += table.note + '\n';
  }
  return text;
}

std::string tables_csv(std::span<const Table> tables) {
  std::string text = "table,sequence,system,column,unit,value,std,text\n";
  for (const Table& table : tables) {
    for (const TableRow& row : table.rows) {
      for (std::size_t i = 0; i < row.cells.size(); ++i) {
        const TableCell& cell = row.cells[i];
        const TableColumn& column = table.columns[i];
        if (!cell.value && cell.text.empty()) continue;
        text += fmt::format("{},{},{},{},{},{},{},{}\n", csv_field(table.id), csv_field(row.sequence),
                            csv_field(row.system), csv_field(column.title), csv_field(column.unit),
                            csv_number(cell.value), csv_number(cell.std), csv_field(cell.text));
      }
    }
  }
  return text;
}

Json tables_json(std::span<const Table> tables) {
  Json json = Json::array();
  for (const Table& table : tables) json.push_back(table_json(table));
  return json;
}

}  // namespace ipl_slam
