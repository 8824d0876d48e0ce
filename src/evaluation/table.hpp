#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace ipl_slam {

/// A value with its spread, or words, or both.
struct TableCell {
  std::optional<double> value;
  std::optional<double> std;  ///< over repeated runs
  std::string text;           ///< behind the value, or in its place
  bool bold = false;
};

struct TableColumn {
  std::string title;
  std::string unit;  ///< may be empty
  int decimals = 4;  ///< in Markdown; kThreeDigits = three significant digits instead

  static constexpr int kThreeDigits = -1;
};

struct TableRow {
  std::string sequence;
  std::string system;  ///< whose figures these are; may be empty
  std::vector<TableCell> cells;
};

struct Table {
  std::string id;     ///< short and stable, for programs
  std::string title;  ///< for people
  std::string note;   ///< below the table
  std::vector<TableColumn> columns;
  std::vector<TableRow> rows;
};

/// For people: a heading, the table and its note, one after the other. A table without rows shows its note
/// alone.
[[nodiscard]] std::string tables_markdown(std::span<const Table> tables);
/// For programs, one line per cell that is not empty:
/// table,sequence,system,column,unit,value,std,text
[[nodiscard]] std::string tables_csv(std::span<const Table> tables);
/// The tables as they are, an array of objects with the names of the structs above; what is absent is null.
[[nodiscard]] nlohmann::ordered_json tables_json(std::span<const Table> tables);

}  // namespace ipl_slam
