#include "sequence_input.hpp"

#include <ipl_slam/error.hpp>

#include "common/interrupt.hpp"
#include "common/log.hpp"
#include "dataset/prefetching_source.hpp"
#include "output.hpp"
#include "pipeline/realtime_source.hpp"

namespace ipl_slam::cli {

std::unique_ptr<RgbdSource> open_source(std::unique_ptr<TumDataset> dataset, const Config& config,
                                        bool realtime) {
  std::unique_ptr<RgbdSource> source = std::make_unique<PrefetchingSource>(std::move(dataset));
  if (!realtime) return source;
  return std::make_unique<RealtimeSource>(std::move(source),
                                          static_cast<std::size_t>(config.schedule.frame_queue), interrupted);
}

std::optional<Trajectory> read_ground_truth(const TumDataset& dataset) {
  const std::optional<std::filesystem::path> file = dataset.ground_truth();
  if (!file) return std::nullopt;
  try {
    std::size_t rejected = 0;
    Trajectory truth = read_trajectory(*file, &rejected);
    if (rejected > 0) log().warn("{}", rejected_lines(file->string(), rejected));
    return truth;
  } catch (const UserError& error) {
    log().warn("no evaluation: {}", error.what());
    return std::nullopt;
  }
}

std::optional<Evaluation> evaluate_run(const std::optional<Trajectory>& truth, const Trajectory& trajectory) {
  if (!truth || trajectory.empty()) return std::nullopt;
  try {
    return evaluate(*truth, trajectory, "run");
  } catch (const UserError& error) {
    // The run itself is good; only its accuracy stays unknown.
    log().warn("no evaluation: {}", error.what());
    return std::nullopt;
  }
}

}  // namespace ipl_slam::cli
