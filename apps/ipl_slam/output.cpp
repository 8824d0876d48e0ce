#include "output.hpp"

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

#include "common/log.hpp"

namespace ipl_slam::cli {

bool says_remarks() {
  return log().should_log(spdlog::level::info);
}

std::string json_text(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

bool make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  const bool created = std::filesystem::create_directories(folder, error);
  if (error) {
    throw UserError(fmt::format("cannot create the output folder '{}': {}; choose another with -o",
                                folder.string(), error.message()));
  }
  return created;
}

std::string rejected_lines(const std::string& file, std::size_t count) {
  return fmt::format("'{}': {} line{} left out (NaN, zero quaternion, duplicate or backward timestamp)", file,
                     count, count == 1 ? "" : "s");
}

}  // namespace ipl_slam::cli
