#pragma once

#include <CLI/CLI.hpp>

// One function per verb of the command line, each in the file of its name. They add a subcommand with its
// options and a callback that does the work; the callback throws UserError for what the user can mend and
// sets the process's exit code through exit_code() where success and error are not the only outcomes.
namespace ipl_slam::cli {

void add_run_verb(CLI::App& app);
void add_segment_verb(CLI::App& app);
void add_eval_verb(CLI::App& app);
void add_map_verb(CLI::App& app);
void add_render_verb(CLI::App& app);
void add_synth_verb(CLI::App& app);
void add_config_verb(CLI::App& app);
void add_bench_verb(CLI::App& app);

/// Ctrl-C ended the work early; what was done is written.
constexpr int kInterrupted = 130;

/// What the process will exit with when no exception ends it; 0 unless a verb sets it.
int& exit_code();

}  // namespace ipl_slam::cli
