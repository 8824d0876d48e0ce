#include "verbs.hpp"

namespace ipl_slam::cli {

void add_eval_verb(CLI::App&) {}

}  // namespace ipl_slam::cli
