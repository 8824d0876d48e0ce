#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace ipl_slam {

/// The 80 classes of COCO (Lin et al., ECCV 2014) in the order in which detectors number them.
[[nodiscard]] const std::vector<std::string>& coco_class_names();

/// The class names that an Ultralytics export carries in its metadata, e.g. "{0: 'person', 1: 'bicycle'}".
/// Empty where the text is not of this form or does not number its classes 0, 1, 2, ...
[[nodiscard]] std::vector<std::string> parse_class_names(std::string_view text);

/// The names of `count` classes: those of the metadata if they are as many, COCO's if there are 80, otherwise
/// "class 0", "class 1", ...
[[nodiscard]] std::vector<std::string> class_names(std::string_view metadata, int count);

/// Which classes a comma-separated list of names asks for, all where it names none. Throws UserError for a
/// name that is not among `names`, with the nearest that is.
[[nodiscard]] std::vector<bool> select_classes(std::string_view list, const std::vector<std::string>& names);

}  // namespace ipl_slam
