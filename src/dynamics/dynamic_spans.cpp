#include "dynamics/dynamic_spans.hpp"

#include <algorithm>

namespace ipl_slam {

void DynamicSpans::add(const DynamicSpan& span) {
  std::vector<DynamicSpan>& spans = spans_[span.id];
  DynamicSpan merged = span;
  while (!spans.empty() && merged.first <= spans.back().last + 1) {
    merged.first = std::min(merged.first, spans.back().first);
    merged.last = std::max(merged.last, spans.back().last);
    spans.pop_back();
  }
  spans.push_back(merged);
}

bool DynamicSpans::contains(InstanceId id, std::size_t frame) const {
  const auto found = spans_.find(id);
  if (found == spans_.end()) return false;
  return std::any_of(found->second.begin(), found->second.end(),
                     [&](const DynamicSpan& s) { return s.first <= frame && frame <= s.last; });
}

}  // namespace ipl_slam
