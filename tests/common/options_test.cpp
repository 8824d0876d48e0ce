#include "common/options.hpp"

#include <cstdint>
#include <fstream>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <ipl_slam/error.hpp>

namespace ipl_slam {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

struct GridOptions {
  int cell_size = 30;
  float overlap = 0.1F;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("cell_size", cell_size, {8, 200, "pixel", "side of a cell"});
    v.number("overlap", overlap, {0.1, 1.0, "", "share of a cell that its neighbours see too"});
  }
  friend bool operator==(const GridOptions&, const GridOptions&) = default;
};

struct OrbOptions {
  int features = 1000;
  bool blur = true;
  std::string detector = "fast";
  GridOptions grid;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("features", features,
             {.min = 50, .max = 10000, .unit = "count", .doc = "keypoints kept per frame"});
    v.flag("blur", blur, "smooth the image before descriptors are taken");
    v.choice("detector", detector, {"fast", "agast"}, "corner detector");
    v.section("grid", grid, "grid that spreads the keypoints");
  }
  friend bool operator==(const OrbOptions&, const OrbOptions&) = default;
};

struct Settings {
  std::uint64_t seed = 7;
  unsigned threads = 2;
  double max_depth = 10.0;
  std::string title = "a \"title\": with\ttrouble # in it";
  OrbOptions orb;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("seed", seed, {0, 18446744073709551615.0, "", "start of every random choice"});
    v.number("threads", threads, {1, 64, "count", "worker threads"});
    v.number("max_depth", max_depth,
             {0.1, std::numeric_limits<double>::infinity(), "m", "depth beyond this is not used"});
    v.text("title", title, "name of the run");
    v.section("orb", orb, "feature extraction");
  }
  friend bool operator==(const Settings&, const Settings&) = default;
};

class SettingsFile : public ::testing::Test {
 protected:
  SettingsFile()
      : file_(std::filesystem::path(::testing::TempDir()) /
              (std::string("options_") + ::testing::UnitTest::GetInstance()->current_test_info()->name() +
               ".yaml")) {}
  ~SettingsFile() override { std::filesystem::remove(file_); }

  const std::filesystem::path& write(const std::string& text) {
    std::ofstream(file_, std::ios::binary) << text;
    return file_;
  }

  Settings load(const std::string& text) {
    Settings settings;
    load_options(settings, write(text));
    return settings;
  }

  // The message the file is refused with, without the file's name in front; "" when it is accepted.
  std::string refusal(const std::string& text) {
    Settings settings;
    try {
      load_options(settings, write(text));
    } catch (const UserError& error) {
      EXPECT_EQ(settings, Settings()) << "a refused file must not change anything";
      const std::string message = error.what();
      EXPECT_THAT(message, StartsWith(file_.string() + ":"));
      EXPECT_EQ(message.find('\n'), std::string::npos) << "one line";
      return message.substr(std::min(message.size(), file_.string().size() + 1));
    }
    return {};
  }

 private:
  std::filesystem::path file_;
};

TEST_F(SettingsFile, SetsTheKeysItHoldsAndLeavesTheOthers) {
  const Settings settings =
      load("seed: 18446744073709551615\norb:\n  features: 1200\n  grid:\n    overlap: 0.5\n");
  Settings expected;
  expected.seed = std::numeric_limits<std::uint64_t>::max();
  expected.orb.features = 1200;
  expected.orb.grid.overlap = 0.5F;
  EXPECT_EQ(settings, expected);
}

TEST_F(SettingsFile, MayBeEmptyOrHoldNothingButCommentsAndEmptySections) {
  EXPECT_EQ(load(""), Settings());
  EXPECT_EQ(load("# nothing\n"), Settings());
  EXPECT_EQ(load("orb:\n  # features: 3\n"), Settings());
}

TEST_F(SettingsFile, TakesDottedKeysToo) {
  EXPECT_EQ(load("orb.grid.cell_size: 40\n").orb.grid.cell_size, 40);
}

TEST_F(SettingsFile, PrintedAndReadBackGivesTheSameValues) {
  Settings settings;
  settings.max_depth = 0.1 + 0.2;  // needs 17 digits
  settings.orb.grid.overlap = 1.0F / 3.0F;
  settings.orb.detector = "agast";
  settings.orb.blur = false;
  EXPECT_EQ(load(options_yaml(option_table(settings))), settings);
}

TEST_F(SettingsFile, WithAMistypedKeyIsRefusedNamingLineAndNearestKey) {
  EXPECT_EQ(refusal("seed: 1\norb:\n  featurs: 1200\n"),
            "3: unknown key 'orb.featurs'; did you mean 'orb.features'?");
  EXPECT_EQ(refusal("Orb:\n  features: 1200\n"), "1: unknown key 'Orb'; did you mean 'orb'?");
}

TEST_F(SettingsFile, WithAKeyInTheWrongSectionIsRefusedNamingTheRightOne) {
  EXPECT_EQ(refusal("cell_size: 20\n"), "1: unknown key 'cell_size'; did you mean 'orb.grid.cell_size'?");
}

TEST_F(SettingsFile, WithAValueOutOfRangeIsRefusedNamingTheRange) {
  EXPECT_EQ(refusal("orb:\n  features: 5\n"),
            "2: 'orb.features' must be a whole number from 50 to 10000 (count), not '5'");
  EXPECT_EQ(refusal("max_depth: -1\n"), "1: 'max_depth' must be a number of at least 0.1 (m), not '-1'");
  EXPECT_THAT(refusal("max_depth: .nan\n"), HasSubstr("'max_depth' must be"));
  EXPECT_THAT(refusal("seed: 18446744073709551616\n"), HasSubstr("'seed' must be a whole number"));
  EXPECT_THAT(refusal("seed: -1\n"), HasSubstr("'seed' must be a whole number"));
}

TEST_F(SettingsFile, MayGiveTheLimitsThemselves) {
  // 0.1 as double is a little below 0.1F: the float's own limit counts.
  const Settings settings =
      load("orb: {features: 50, grid: {overlap: 0.1, cell_size: 200}}\nmax_depth: .inf\n");
  EXPECT_EQ(settings.orb.features, 50);
  EXPECT_EQ(settings.orb.grid.overlap, 0.1F);
  EXPECT_EQ(settings.orb.grid.cell_size, 200);
  EXPECT_EQ(settings.max_depth, std::numeric_limits<double>::infinity());
}

TEST_F(SettingsFile, WithAValueOfTheWrongKindIsRefused) {
  for (const char* value :
       {"1.5", "12 m", "many", "\"1200\"", "[1200]", "{a: 1}", "", "~", "0x500", "1e3", "--5"}) {
    EXPECT_THAT(refusal(std::string("orb:\n  features: ") + value + "\n"),
                StartsWith("2: 'orb.features' must be a whole number from 50 to 10000 (count), not "))
        << value;
  }
  for (const char* value : {"yes", "1", "\"true\"", "[true]"}) {
    EXPECT_THAT(refusal(std::string("orb: {blur: ") + value + "}\n"),
                StartsWith("1: 'orb.blur' must be true or false, not "))
        << value;
  }
  EXPECT_EQ(refusal("orb: 5\n"), "1: 'orb' must be a section with keys of its own, not '5'");
}

TEST_F(SettingsFile, WithAnUnknownChoiceIsRefusedNamingTheChoices) {
  EXPECT_EQ(refusal("orb:\n  detector: fats\n"),
            "2: 'orb.detector' must be one of: fast, agast, not 'fats'; did you mean 'fast'?");
}

TEST_F(SettingsFile, WithAKeyGivenTwiceIsRefused) {
  EXPECT_EQ(refusal("seed: 1\nseed: 2\n"), "2: key 'seed' is given twice; keep one of them");
  EXPECT_EQ(refusal("orb: {blur: true}\norb: {features: 100}\n"),
            "2: key 'orb' is given twice; keep one of them");
  EXPECT_EQ(refusal("orb.features: 100\norb:\n  features: 100\n"),
            "3: key 'orb.features' is given twice; keep one of them");
}

TEST_F(SettingsFile, ThatIsNoSingleMapIsRefused) {
  EXPECT_THAT(refusal("- 1\n- 2\n"), StartsWith("1: settings must be lines of the form"));
  EXPECT_THAT(refusal("just words\n"), StartsWith("1: settings must be lines of the form"));
  EXPECT_THAT(refusal("seed: 1\n---\nseed: 2\n"), HasSubstr("second YAML document"));
  EXPECT_THAT(refusal("---\nseed: 1\n...\nseed: 2\n"), HasSubstr("second YAML document"));
  EXPECT_THAT(refusal(",,,,,\nseed: 1\n"), HasSubstr("key: value")) << "and ends";
  EXPECT_THAT(refusal("[a, b]: 1\n"), HasSubstr("a key must be a plain name"));
}

TEST_F(SettingsFile, ThatIsNoYamlIsRefusedNamingTheLine) {
  EXPECT_THAT(refusal("seed: 1\norb: {features: 100\n"), HasSubstr("is not valid YAML: "));
  EXPECT_THAT(refusal("seed: 1\n\torb: 3\n"), StartsWith("2: is not valid YAML: "));
  EXPECT_THAT(refusal("seed: *nowhere\n"), StartsWith("1: is not valid YAML: "));
}

TEST_F(SettingsFile, WithValuesOverManyLinesIsRefusedInOneLine) {
  EXPECT_THAT(refusal("orb:\n  detector: |\n    one\n    two\n"), HasSubstr("not 'one two '"));
}

TEST(SettingsFileMissing, IsRefusedNamingTheFile) {
  Settings settings;
  try {
    load_options(settings, "no/such/file.yaml");
    FAIL() << "a file that does not exist was read";
  } catch (const UserError& error) {
    EXPECT_THAT(error.what(), AllOf(StartsWith("no/such/file.yaml: "), HasSubstr("cannot be read")));
  }
  EXPECT_THROW(load_options(settings, ::testing::TempDir()), UserError) << "a folder is no settings file";
}

std::string assignment_refusal(const char* assignment) {
  Settings settings;
  try {
    set_option(settings, assignment);
  } catch (const UserError& error) {
    EXPECT_EQ(settings, Settings());
    return error.what();
  }
  return {};
}

TEST(Assignment, SetsOneKey) {
  Settings settings;
  set_option(settings, "orb.features=1200");
  set_option(settings, "title=x=y");
  set_option(settings, "orb.blur=false");
  EXPECT_EQ(settings.orb.features, 1200);
  EXPECT_EQ(settings.title, "x=y") << "only the first '=' separates";
  EXPECT_FALSE(settings.orb.blur);
}

TEST(Assignment, IsRefusedAsAFileWouldBe) {
  EXPECT_EQ(assignment_refusal("orb.featurs=1200"),
            "setting 'orb.featurs=1200': unknown key 'orb.featurs'; did you mean 'orb.features'?");
  EXPECT_THAT(assignment_refusal("orb.features=1.5"), HasSubstr("a whole number from 50 to 10000"));
  EXPECT_THAT(assignment_refusal("orb=1"), HasSubstr("'orb' is a section"));
  EXPECT_THAT(assignment_refusal("orb.features"), HasSubstr("KEY=VALUE"));
  EXPECT_THAT(assignment_refusal("=5"), HasSubstr("KEY=VALUE"));
}

TEST(OptionsYaml, ShowsMeaningUnitAndRangeOfEveryKey) {
  Settings settings;
  const std::string yaml = options_yaml(option_table(settings));
  EXPECT_THAT(yaml, HasSubstr("  # keypoints kept per frame: a whole number from 50 to 10000 (count)\n"
                              "  features: 1000\n"));
  EXPECT_THAT(yaml,
              HasSubstr("# depth beyond this is not used: a number of at least 0.1 (m)\nmax_depth: 10.0\n"));
  EXPECT_THAT(yaml, HasSubstr("  # corner detector: one of: fast, agast\n  detector: fast\n"));
  EXPECT_THAT(yaml, HasSubstr("\n  # grid that spreads the keypoints\n  grid:\n    # side of a cell"));
}

TEST(OptionsJson, HoldsTheValuesInTheirSections) {
  Settings settings;
  const nlohmann::ordered_json json = options_json(option_table(settings));
  EXPECT_EQ(json["seed"], 7);
  EXPECT_EQ(json["orb"]["blur"], true);
  EXPECT_EQ(json["orb"]["grid"]["cell_size"], 30);
  EXPECT_EQ(json.begin().key(), "seed") << "order of declaration";
  EXPECT_EQ(json.size(), 5U);
}

TEST(OptionsMarkdown, HasARowForEveryKey) {
  Settings settings;
  const std::string markdown = options_markdown(option_table(settings));
  EXPECT_THAT(markdown, HasSubstr("## orb\n\nfeature extraction\n\n| key | default |"));
  EXPECT_THAT(markdown, HasSubstr("| `orb.features` | 1000 | count | a whole number from 50 to 10000 | "
                                  "keypoints kept per frame |\n"));
  EXPECT_THAT(markdown, HasSubstr("| `orb.grid.cell_size` | 30 | pixel |"));
  EXPECT_THAT(markdown, EndsWith("|\n"));
}

TEST(OptionCheck, FindsAFieldThatWasSetWrongInCode) {
  Settings settings;
  EXPECT_NO_THROW(check_options(settings));
  settings.orb.grid.cell_size = 1;
  try {
    check_options(settings);
    FAIL() << "1 is below the least cell size";
  } catch (const UserError& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("'orb.grid.cell_size' must be a whole number from 8 to 200 (pixel), not '1'"));
  }
}

}  // namespace
}  // namespace ipl_slam
