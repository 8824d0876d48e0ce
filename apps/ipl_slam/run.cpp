#include "verbs.hpp"

namespace ipl_slam::cli {

void add_run_verb(CLI::App&) {}

}  // namespace ipl_slam::cli
