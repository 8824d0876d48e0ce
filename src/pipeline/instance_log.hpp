#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "dynamics/dynamic_spans.hpp"
#include "pipeline/instance_record.hpp"
#include "pipeline/sequence_run.hpp"

namespace ipl_slam {

/// A line of instances.jsonl (docs/formats.md): a frame's instances and what was decided on them. `dynamic`:
/// in which frames their masks were found to be dynamic, also later.
[[nodiscard]] std::string instances_line(std::size_t frame, double timestamp, int mask_age,
                                         const std::vector<InstanceRecord>& instances,
                                         const DynamicSpans& dynamic = {});
/// The whole file: a line per processed frame.
[[nodiscard]] std::string instances_jsonl(const SequenceRun& run, const DynamicSpans& dynamic);

}  // namespace ipl_slam
