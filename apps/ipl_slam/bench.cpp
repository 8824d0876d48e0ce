#include "verbs.hpp"

namespace ipl_slam::cli {

void add_bench_verb(CLI::App&) {}

}  // namespace ipl_slam::cli
