#pragma once

#include "map/local_map.hpp"
#include "mapping/local_mapper.hpp"
#include "support/synthetic_world.hpp"

namespace ipl_slam::test {

/// A map and the mapper that builds it, with the local map after each keyframe.
class Mapped {
 public:
  explicit Mapped(LocalMapper mapper, const LocalMapOptions& local_map = {})
      : mapper_(std::move(mapper)), options_(local_map) {}

  std::shared_ptr<const LocalMap> process(const KeyframeCandidate& candidate) {
    const KeyframeId id = mapper_.process(map_, candidate);
    return std::make_shared<const LocalMap>(build_local_map(map_, id, options_));
  }
  [[nodiscard]] const Map& map() const { return map_; }
  [[nodiscard]] const LocalMapper& mapper() const { return mapper_; }

 private:
  Map map_{kTestPyramid};
  LocalMapper mapper_;
  LocalMapOptions options_;
};

}  // namespace ipl_slam::test
