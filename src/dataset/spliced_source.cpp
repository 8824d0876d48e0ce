#include "dataset/spliced_source.hpp"

#include <algorithm>
#include <stdexcept>

namespace ipl_slam {
namespace {

void check(const SplicedSource::Cut& cut, std::size_t sources) {
  if (cut.source >= sources) throw std::invalid_argument("a cut names a source that is not there");
  if (cut.last < cut.first) throw std::invalid_argument("a cut ends before it begins");
}

// The items of a source up to the last one that any cut needs.
std::vector<SourceItem> read(RgbdSource& source, std::size_t number,
                             const std::vector<SplicedSource::Cut>& cuts) {
  std::size_t count = 0;
  for (const SplicedSource::Cut& cut : cuts) {
    if (cut.source == number) count = std::max(count, cut.last + 1);
  }
  std::vector<SourceItem> items;
  while (items.size() < count) {
    std::optional<SourceItem> item = source.next();
    if (!item) throw std::invalid_argument("a cut reaches beyond the end of its source");
    const bool needed = std::any_of(cuts.begin(), cuts.end(), [&](const SplicedSource::Cut& cut) {
      return cut.source == number && cut.first <= items.size() && items.size() <= cut.last;
    });
    items.push_back(needed ? std::move(*item) : SourceItem{});
  }
  return items;
}

void cover(RgbdFrame& frame) {
  // New images: assigning zeros to the old ones would blacken those of other frames that share their pixels.
  frame.color = cv::Mat(frame.color.size(), frame.color.type(), cv::Scalar::all(0));
  frame.depth = cv::Mat(frame.depth.size(), frame.depth.type(), cv::Scalar::all(0));
}

}  // namespace

SplicedSource::SplicedSource(const std::vector<RgbdSource*>& sources, const std::vector<Cut>& cuts,
                             double step) {
  if (cuts.empty()) throw std::invalid_argument("there is no cut to play");
  if (!(step > 0.0)) throw std::invalid_argument("the time between two cuts must be positive");
  for (const Cut& cut : cuts) check(cut, sources.size());
  std::vector<std::vector<SourceItem>> taken;
  for (std::size_t i = 0; i < sources.size(); ++i) taken.push_back(read(*sources[i], i, cuts));
  for (const Cut& cut : cuts) append(taken[cut.source], cut, step);
}

void SplicedSource::append(const std::vector<SourceItem>& read, const Cut& cut, double step) {
  const double start = items_.empty() ? read[cut.first].timestamp : items_.back().timestamp + step;
  for (std::size_t i = cut.first; i <= cut.last; ++i) {
    SourceItem item = read[i];
    item.timestamp = start + (read[i].timestamp - read[cut.first].timestamp);
    if (item.frame) {
      item.frame->index = items_.size();
      item.frame->timestamp = item.timestamp;
      if (cut.covered) cover(*item.frame);
    }
    items_.push_back(std::move(item));
    origins_.push_back({cut.source, i, cut.covered});
  }
}

std::optional<SourceItem> SplicedSource::next() {
  if (position_ >= items_.size()) return std::nullopt;
  return items_[position_++];
}

}  // namespace ipl_slam
