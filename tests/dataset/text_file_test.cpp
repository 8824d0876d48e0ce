#include "common/text_file.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ipl_slam/error.hpp>

#include "dataset/temporary_folder.hpp"

namespace ipl_slam {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::message_of;
using testing::TemporaryFolder;

TEST(TextFile, GivesDataLinesWithTheirNumbers) {
  const TemporaryFolder folder;
  const auto file = folder.write("list.txt", "\xEF\xBB\xBF# head\r\n\r\n  one two \r\n\t# more\nthree");
  const std::vector<TextLine> lines = read_lines(file);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0].number, 3u);
  EXPECT_EQ(lines[0].text, "one two");
  EXPECT_EQ(lines[1].number, 5u);
  EXPECT_EQ(lines[1].text, "three");
}

TEST(TextFile, SplitsAtBlanksTabsAndCommas) {
  EXPECT_THAT(split_words(" 1.5,\t2  x.png\r"), ElementsAre("1.5", "2", "x.png"));
  EXPECT_TRUE(split_words(" , ").empty());
}

TEST(TextFile, TakesForANumberOnlyWhatIsOneAsAWhole) {
  EXPECT_EQ(parse_number("1305031453.359684"), 1305031453.359684);
  EXPECT_EQ(parse_number("-1e-3"), -1e-3);
  EXPECT_EQ(parse_number("+2"), 2.0);
  EXPECT_TRUE(std::isnan(parse_number("nan").value()));
  for (const char* word : {"", "+", "+-1", "1.5x", "rgb/1.png", "0x10", "1 2"})
    EXPECT_FALSE(parse_number(word)) << word;
}

TEST(TextFile, SaysWhichFileIsMissingOrAFolder) {
  const TemporaryFolder folder;
  EXPECT_THAT(message_of<UserError>([&] { (void)read_file(folder / "none.txt"); }),
              HasSubstr("none.txt': no such file"));
  EXPECT_THAT(message_of<UserError>([&] { (void)read_file(folder.path()); }), HasSubstr("it is a folder"));
}

}  // namespace
}  // namespace ipl_slam
