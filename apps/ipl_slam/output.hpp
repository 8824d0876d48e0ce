#pragma once

#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

// What the verbs have in common in what they say.
namespace ipl_slam::cli {

/// Whether remarks and progress are wanted, which --quiet switches off. Results and errors always are.
[[nodiscard]] bool says_remarks();

/// Readable JSON, ending in a newline. Bytes that are no UTF-8, as a file's name may hold, are replaced:
/// the figures beside them must not be lost.
[[nodiscard]] std::string json_text(const nlohmann::ordered_json& json);

/// Makes a folder for results, with those above it; whether it was not there before. Throws UserError.
bool make_folder(const std::filesystem::path& folder);

/// The remark on lines of a trajectory file that could not be used.
[[nodiscard]] std::string rejected_lines(const std::string& file, std::size_t count);

}  // namespace ipl_slam::cli
