#include "common/log.hpp"

#include <cstdio>
#include <memory>
#include <mutex>

#include <spdlog/sinks/base_sink.h>

#include "common/progress.hpp"

namespace ipl_slam {
namespace {

const char* prefix(spdlog::level::level_enum level) {
  switch (level) {
    case spdlog::level::critical:
    case spdlog::level::err:
      return "error: ";
    case spdlog::level::warn:
      return "warning: ";
    case spdlog::level::debug:
    case spdlog::level::trace:
      return "debug: ";
    default:
      return "";
  }
}

class StderrSink final : public spdlog::sinks::base_sink<std::mutex> {
 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::string line =
        prefix(message.level) + std::string(message.payload.data(), message.payload.size());
    // A bar that is being drawn would end up in the middle of the line; it comes back with its next redraw.
    ProgressBar::hide_drawn_line();
    std::fprintf(stderr, "%s\n", line.c_str());
  }
  void flush_() override { std::fflush(stderr); }
};

spdlog::logger make_logger() {
  spdlog::logger logger("ipl_slam", std::make_shared<StderrSink>());
  logger.set_level(spdlog::level::info);
  return logger;
}

}  // namespace

spdlog::logger& log() {
  static spdlog::logger logger = make_logger();
  return logger;
}

void set_log_level(LogLevel level) {
  switch (level) {
    case LogLevel::kQuiet:
      return log().set_level(spdlog::level::err);
    case LogLevel::kNormal:
      return log().set_level(spdlog::level::info);
    case LogLevel::kVerbose:
      return log().set_level(spdlog::level::debug);
  }
}

}  // namespace ipl_slam
