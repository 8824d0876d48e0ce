#include <fmt/format.h>

#include <cstdio>
#include <ipl_slam/error.hpp>

#include "verbs.hpp"

namespace ipl_slam::cli {
int& exit_code() {
  static int code = 0;
  return code;
}
}  // namespace ipl_slam::cli

int main(int argc, char** argv) {
  using namespace ipl_slam::cli;
  CLI::App app{"IPL-SLAM: RGB-D visual SLAM that keeps working while people walk through the picture"};
  app.require_subcommand(1);
  add_run_verb(app);
  add_eval_verb(app);
  add_synth_verb(app);
  add_config_verb(app);
  add_bench_verb(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const ipl_slam::UserError& error) {
    fmt::print(stderr, "ipl_slam: {}\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "ipl_slam: internal error: {}\n", error.what());
    return 1;
  }
  return exit_code();
}
