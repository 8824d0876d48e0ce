#pragma once

#include <string>
#include <string_view>

namespace ipl_slam {

/// A short name for some content, to tell whether it changed: the 64-bit FNV-1a hash (Fowler, Noll, Vo) as 16
/// hexadecimal digits. The same on every machine; no protection against intent.
[[nodiscard]] std::string fingerprint(std::string_view content);

}  // namespace ipl_slam
