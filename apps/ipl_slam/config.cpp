#include "verbs.hpp"

namespace ipl_slam::cli {

void add_config_verb(CLI::App&) {}

}  // namespace ipl_slam::cli
