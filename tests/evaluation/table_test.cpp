#include "evaluation/table.hpp"

#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ipl_slam {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

Table small_table() {
  return {"1",
          "Errors",
          "A note.",
          {{"RMSE", "m", 3}, {"p", "", TableColumn::kThreeDigits}},
          {{"room", "ours", {{0.01251, 0.0021, "†", false}, {1.23456e-5, {}, {}, false}}},
           {"room", "theirs", {{0.02, {}, {}, true}, {}}},
           {"a|b", "ours", {{{}, {}, "failed, \"sadly\"", false}, {}}}}};
}

TEST(Tables, AsMarkdownAreReadable) {
  EXPECT_EQ(tables_markdown(std::array{small_table()}),
            "## Errors\n\n"
            "| Sequence | System | RMSE [m] | p |\n"
            "|---|---|---:|---:|\n"
            "| room | ours | 0.013 ± 0.002 † | 1.23e-05 |\n"
            "|  | theirs | **0.020** | – |\n"
            "| a\\|b | ours | failed, \"sadly\" | – |\n"
            "\nA note.\n");
}

TEST(Tables, WithoutSystemsHaveNoSuchColumnAndWithoutRowsOnlyANote) {
  Table table = small_table();
  for (TableRow& row : table.rows) row.system.clear();
  EXPECT_THAT(tables_markdown(std::array{table}), Not(HasSubstr("System")));
  table.rows.clear();
  EXPECT_EQ(tables_markdown(std::array{table}), "## Errors\n\nA note.\n");
}

TEST(Tables, AsCsvHaveALinePerCell) {
  EXPECT_EQ(tables_csv(std::array{small_table()}),
            "table,sequence,system,column,unit,value,std,text\n"
            "1,room,ours,RMSE,m,0.01251,0.0021,†\n"
            "1,room,ours,p,,1.23456e-05,,\n"
            "1,room,theirs,RMSE,m,0.02,,\n"
            "1,a|b,ours,RMSE,m,,,\"failed, \"\"sadly\"\"\"\n");
}

TEST(Tables, AsJsonKeepEveryDigit) {
  const nlohmann::ordered_json json = tables_json(std::array{small_table()});
  ASSERT_EQ(json.size(), 1u);
  EXPECT_EQ(json[0]["id"], "1");
  EXPECT_EQ(json[0]["columns"][0]["unit"], "m");
  const auto& cells = json[0]["rows"][0]["cells"];
  EXPECT_EQ(cells[0]["value"], 0.01251);
  EXPECT_EQ(cells[0]["std"], 0.0021);
  EXPECT_TRUE(cells[1]["std"].is_null());
  EXPECT_EQ(json[0]["rows"][1]["cells"][0]["bold"], true);
}

}  // namespace
}  // namespace ipl_slam
