#include "dataset/find_sequences.hpp"

#include <algorithm>
#include <set>
#include <system_error>

#include <fmt/format.h>

#include <ipl_slam/error.hpp>

namespace ipl_slam {
namespace {

namespace fs = std::filesystem;

bool is_sequence(const fs::path& folder) {
  std::error_code ignored;
  for (const char* list : {"rgb.txt", "associations.txt", "associate.txt"}) {
    if (fs::is_regular_file(folder / list, ignored)) return true;
  }
  return false;
}

std::vector<fs::path> folders_in(const fs::path& folder) {
  std::vector<fs::path> folders;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code ignored;
    if (entry->is_directory(ignored)) folders.push_back(entry->path());
  }
  std::sort(folders.begin(), folders.end());
  return folders;
}

// `visited`: where it has been, by true path, so that a link to a folder above does not lead in circles.
void search(const fs::path& folder, std::set<fs::path>& visited, std::vector<fs::path>& found) {
  std::error_code error;
  if (const fs::path place = fs::canonical(folder, error); error || !visited.insert(place).second) return;
  if (is_sequence(folder)) {
    found.push_back(folder);
    return;
  }
  for (const fs::path& inner : folders_in(folder)) search(inner, visited, found);
}

}  // namespace

std::vector<fs::path> find_sequences(const fs::path& root) {
  std::error_code error;
  if (!fs::is_directory(root, error)) {
    throw UserError(fmt::format("'{}': no such folder; give the one the sequences lie in", root.string()));
  }
  std::set<fs::path> visited;
  std::vector<fs::path> found;
  search(root, visited, found);
  return found;
}

}  // namespace ipl_slam
