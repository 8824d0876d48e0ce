#pragma once

#include <cstddef>
#include <memory>
#include <optional>

#include "pipeline/mapping_schedule.hpp"

namespace ipl_slam {

/// Line extraction and the mapper run on a thread each, one behind the other, and behind a bounded queue; a
/// waiting keyframe cuts local bundle adjustment short. Known places are looked for, and global bundle
/// adjustment is made, on two further threads.
[[nodiscard]] std::unique_ptr<MappingSchedule> make_realtime_mapping(MapKeeper keeper,
                                                                     std::optional<KeyframeLines> lines,
                                                                     std::size_t queue_size);

}  // namespace ipl_slam
