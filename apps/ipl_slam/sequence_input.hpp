#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "dataset/trajectory.hpp"
#include "dataset/tum_dataset.hpp"
#include "evaluation/report.hpp"
#include "pipeline/config.hpp"

// What the verbs that run the system on a sequence need around it.
namespace ipl_slam::cli {

/// The sequence as it is fed to the pipeline: read ahead and, in realtime, played at recorded speed until the
/// user interrupts.
[[nodiscard]] std::unique_ptr<RgbdSource> open_source(std::unique_ptr<TumDataset> dataset,
                                                      const Config& config, bool realtime);

/// The ground truth of a sequence, if there is a usable one: without, a run is as good, only its accuracy
/// stays unknown. Warns of what cannot be used.
[[nodiscard]] std::optional<Trajectory> read_ground_truth(const TumDataset& dataset);

/// Compares a run with the ground truth, if there is any; warns where that cannot be done.
[[nodiscard]] std::optional<Evaluation> evaluate_run(const std::optional<Trajectory>& truth,
                                                     const Trajectory& trajectory);

}  // namespace ipl_slam::cli
