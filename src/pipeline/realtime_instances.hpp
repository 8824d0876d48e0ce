#pragma once

#include <memory>

#include "pipeline/instance_schedule.hpp"
#include "segmentation/segmenter.hpp"

namespace ipl_slam {

/// Segmentation and verdicts on a thread each. The segmenter takes the newest frame whenever it is ready;
/// see() never waits for it: it carries the newest masks there are from frame to frame, up to the one at
/// hand.
[[nodiscard]] std::unique_ptr<InstanceSchedule> make_realtime_instances(std::unique_ptr<Segmenter> segmenter,
                                                                        const Camera& camera,
                                                                        const Config& config);

}  // namespace ipl_slam
