#pragma once

#include <CLI/CLI.hpp>

namespace ipl_slam::cli {

/// Adds `bench tum`: all sequences below a folder, several times, to tables.
void add_bench_tum(CLI::App& bench);

}  // namespace ipl_slam::cli
