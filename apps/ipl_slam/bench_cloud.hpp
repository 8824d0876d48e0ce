#pragma once

#include <CLI/CLI.hpp>

namespace ipl_slam::cli {

/// Adds `bench cloud`: the cloud of a run beside what the depth images of a sequence show from their true
/// poses (evaluation/cloud_error.hpp). The cloud is moved as the run's trajectory fits the ground truth. Of a
/// rendered sequence the same one without noise is the truth.
void add_bench_cloud(CLI::App& bench);

}  // namespace ipl_slam::cli
