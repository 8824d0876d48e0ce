#include "verbs.hpp"

namespace ipl_slam::cli {

void add_synth_verb(CLI::App&) {}

}  // namespace ipl_slam::cli
