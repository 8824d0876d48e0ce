#include "pipeline/mapping_schedule.hpp"

#include <utility>

#include "common/stopwatch.hpp"

namespace ipl_slam {
namespace {

class LockstepMapping final : public MappingSchedule {
 public:
  LockstepMapping(MapKeeper keeper, std::optional<KeyframeLines> lines)
      : keeper_(std::move(keeper)), lines_(std::move(lines)), local_map_(keeper_.around_newest()) {}

  void start(NewKeyframe first) override { submit(std::move(first)); }
  void submit(NewKeyframe keyframe) override {
    if (lines_) region_lines_ = lines_->process(keyframe);
    const Stopwatch stopwatch;
    local_map_ = keeper_.add(keyframe.candidate);
    if (keeper_.wants_global_bundle()) {
      GlobalBundle bundle = keeper_.begin_global_bundle();
      bundle.solve();
      keeper_.apply(bundle);
      local_map_ = keeper_.around(local_map_->centre);
    }
    records_.push_back({keyframe.candidate.tracked.frame->index, keyframe.line_milliseconds,
                        stopwatch.milliseconds(), keeper_.removed()});
  }
  [[nodiscard]] std::optional<FoundPlace> find_place(const TrackedFrame& lost) override {
    return keeper_.find_place(lost);
  }
  void resume_at(const FoundPlace& place) override {
    local_map_ = place.map;
    keeper_.note(place.event);
  }
  void move_to(KeyframeId id) override { local_map_ = keeper_.around(id); }
  [[nodiscard]] std::shared_ptr<const LocalMap> local_map() const override { return local_map_; }
  [[nodiscard]] bool idle() const override { return true; }
  [[nodiscard]] bool has_room() const override { return true; }
  [[nodiscard]] std::vector<RegionLines> take_region_lines() override {
    return std::exchange(region_lines_, {});
  }
  void finish() override {}
  [[nodiscard]] std::vector<PlaceEvent> events() const override { return keeper_.events(); }
  void read(const std::function<void(const Map&, const std::vector<MappingRecord>&)>& fn) const override {
    fn(keeper_.map(), records_);
  }

 private:
  MapKeeper keeper_;
  std::optional<KeyframeLines> lines_;
  std::shared_ptr<const LocalMap> local_map_;
  std::vector<RegionLines> region_lines_;
  std::vector<MappingRecord> records_;
};

}  // namespace

std::unique_ptr<MappingSchedule> make_lockstep_mapping(MapKeeper keeper, std::optional<KeyframeLines> lines) {
  return std::make_unique<LockstepMapping>(std::move(keeper), std::move(lines));
}

}  // namespace ipl_slam
