#pragma once

#include <string_view>

namespace ipl_slam {

/// What a class of instances tells about motion before anything was measured (paper, section 3.2).
enum class ClassRole {
  likely_mover,  ///< moves by itself: people, animals, vehicles
  movable,       ///< stays unless carried, pushed or thrown: chair, ball, cup, laptop, ...
  background,    ///< hardly ever moves, e.g. a traffic light, a sink, a bed
};

/// The role of a class by its COCO name. A name that is not COCO's, "unknown" among them, is movable: it may
/// move, and nothing says that it does.
[[nodiscard]] ClassRole class_role(std::string_view class_name);

}  // namespace ipl_slam
