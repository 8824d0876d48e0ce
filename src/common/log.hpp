#pragma once

#include <spdlog/logger.h>

namespace ipl_slam {

/// How much is said on stderr.
enum class LogLevel {
  kQuiet,    ///< errors only
  kNormal,   ///< warnings and what the user should know
  kVerbose,  ///< and what helps to find a fault
};

/// The project's one logger: log().warn("{}: no depth", file). Lines go to stderr as "warning: ...", without
/// colours and times, and do not mix with a progress bar. Thread-safe.
[[nodiscard]] spdlog::logger& log();

/// Chooses what log() lets through; kNormal until it is called.
void set_log_level(LogLevel level);

}  // namespace ipl_slam
