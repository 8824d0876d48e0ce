#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core/utility.hpp>

#include <ipl_slam/error.hpp>
#include <ipl_slam/version.hpp>

#include "common/log.hpp"
#include "common/nearest_name.hpp"
#include "verbs.hpp"

namespace ipl_slam::cli {

int& exit_code() {
  static int code = 0;
  return code;
}

namespace {

constexpr int kInternalError = 1, kUserError = 2;

constexpr const char* kFooter = R"(Examples:
  ipl_slam run rgbd_dataset_freiburg1_desk -o out/desk   track and map a recorded sequence
  ipl_slam segment rgbd_dataset_freiburg3_walking_xyz --model yolov8n-seg.onnx -o out/who
  ipl_slam synth out/room && ipl_slam run out/room -o out/run
  ipl_slam eval groundtruth.txt out/desk/trajectory.txt  accuracy against ground truth
  ipl_slam map export office.map -o out/office           a saved map as TUM, PLY, JSON and PNG
  ipl_slam render out/desk -o desk.png                   a picture of its point cloud
  ipl_slam config > settings.yaml                        every setting, with its meaning

`ipl_slam VERB --help` lists the options of a verb.
Exit codes: 0 success, 2 an error you can mend, 130 interrupted (what was done is written), 1 a fault of the program.)";

std::vector<std::string> verb_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(verb->get_name());
  }
  return names;
}

// CLI11 would call a mistyped verb "an argument that was not expected"; the verb is the first word that is no
// option.
void check_verb(const CLI::App& app, int argc, char** argv) {
  const std::vector<std::string> names = verb_names(app);
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word.starts_with('-')) continue;
    if (std::find(names.begin(), names.end(), word) == names.end()) {
      throw UserError(fmt::format("there is no verb '{}'; did you mean '{}'? Verbs: {}", word,
                                  nearest_name(word, names), fmt::join(names, ", ")));
    }
    return;
  }
}

void add_common_options(CLI::App& app) {
  app.set_version_flag("--version", fmt::format("ipl_slam {}", kVersion), "Print the version and exit");
  auto* quiet = app.add_flag_callback(
      "-q,--quiet", [] { set_log_level(LogLevel::kQuiet); },
      "No progress, no remarks: results and errors only");
  app.add_flag_callback(
         "-v,--verbose", [] { set_log_level(LogLevel::kVerbose); }, "Say more, on stderr")
      ->excludes(quiet);
  // The options above may stand after the verb, too.
  app.fallthrough();
}

const CLI::App& innermost(const CLI::App& app) {
  const CLI::App* verb = &app;
  while (!verb->get_subcommands().empty()) verb = verb->get_subcommands().front();
  return *verb;
}

// CLI11 complains of what is missing before it comes to words it does not know, which are mostly the reason.
std::string explain(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<std::string> unknown = app.remaining(true);
  if (unknown.empty()) return error.what();
  const CLI::App& verb = innermost(app);
  std::vector<std::string> known = verb_names(verb);
  const bool is_option = unknown.front().starts_with('-');
  if (is_option) {
    known.clear();
    for (const CLI::App* level : {&app, &verb}) {
      for (const CLI::Option* option : level->get_options()) {
        for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
      }
    }
  }
  if (known.empty()) return fmt::format("'{}' was not expected", unknown.front());
  return fmt::format("there is no {} '{}'; did you mean '{}'?", is_option ? "option" : "verb",
                     unknown.front(), nearest_name(unknown.front(), known));
}

int report(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
  std::string command = "ipl_slam";
  for (const CLI::App* level = &app; !level->get_subcommands().empty();) {
    level = level->get_subcommands().front();
    command += ' ' + level->get_name();
  }
  std::string message =
      app.get_subcommands().empty() && dynamic_cast<const CLI::RequiredError*>(&error) != nullptr
          ? fmt::format("no verb given; verbs: {}", fmt::join(verb_names(app), ", "))
          : explain(app, error);
  std::replace(message.begin(), message.end(), '\n', ' ');
  fmt::print(stderr, "{}: {}; see '{} --help'\n", command, message, command);
  return kUserError;
}

int run(int argc, char** argv) {
  CLI::App app{"IPL-SLAM: visual SLAM for RGB-D cameras", "ipl_slam"};
  add_common_options(app);
  add_run_verb(app);
  add_segment_verb(app);
  add_eval_verb(app);
  add_map_verb(app);
  add_render_verb(app);
  add_synth_verb(app);
  add_config_verb(app);
  add_bench_verb(app);
  app.footer(kFooter);  // after the verbs were added, or each would inherit it
  if (argc < 2) {
    fmt::print("{}", app.help());
    return 0;
  }
  try {
    check_verb(app, argc, argv);
    app.require_subcommand(1);
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return report(app, error);
  }
  return exit_code();
}

// Whether everything printed was taken by whoever reads it; says so if not.
bool output_arrived() {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return true;
  fmt::print(stderr, "ipl_slam: cannot write to standard output; is the disk full?\n");
  return false;
}

}  // namespace
}  // namespace ipl_slam::cli

int main(int argc, char** argv) {
  using namespace ipl_slam::cli;
  // Threads are ours to hand out (schedule.threads). OpenCV's own would compete with them, and
  // ThreadSanitizer, which cannot see into the library they come from, reports races or hangs.
  cv::setNumThreads(1);
  try {
    const int code = run(argc, argv);
    return code == 0 && !output_arrived() ? kUserError : code;
  } catch (const ipl_slam::UserError& error) {
    std::fflush(stdout);  // where both go to one file the error must come last
    fmt::print(stderr, "ipl_slam: {}\n", error.what());
    return kUserError;
  } catch (const std::exception& error) {
    if (!output_arrived()) return kUserError;  // fmt throws where stdout takes no more
    fmt::print(stderr, "ipl_slam: internal error: {}\n", error.what());
    return kInternalError;
  }
}
