#pragma once

#include <chrono>
#include <cstddef>
#include <cstdio>
#include <mutex>
#include <string>

namespace ipl_slam {

/// What a progress display says, apart from how it is drawn.
struct ProgressState {
  std::string label;  ///< what is being done: "tracking"
  std::string unit = "frames";
  std::size_t done = 0;
  std::size_t total = 0;   ///< 0 = not known
  double elapsed_s = 0.0;  ///< seconds since the start
  std::string note;        ///< shown at the end, e.g. "lost 3"

  /// Mean speed so far, 1/s; 0 while nothing is known.
  [[nodiscard]] double rate() const;
};

/// "tracking 120/600 frames, 34.2 frames/s, ETA 14 s, lost 3"; without total "tracking 120 frames, 34.2
/// frames/s".
[[nodiscard]] std::string progress_text(const ProgressState& state);
/// "tracking [#####>        ] 120/600 frames, 34.2 frames/s, ETA 14 s": at most `width` characters; the bar
/// takes what the text leaves and is left out where it would be too short to read.
[[nodiscard]] std::string progress_line(const ProgressState& state, std::size_t width);
/// "9 s", "3 min 07 s", "2 h 05 min".
[[nodiscard]] std::string format_duration(double seconds);

/// Shows on stdout how far a loop is. On a terminal one line that is redrawn a few times a second; otherwise
/// (a file, a pipe) plain lines at about every tenth of the work. ASCII only. Thread-safe. Draw one bar at a
/// time.
class ProgressBar {
 public:
  /// `total` 0 = not known; then plain lines come at 100, 200, 400, ... steps.
  ProgressBar(std::string label, std::size_t total, std::string unit = "frames");
  /// The same on another stream, drawn as on a terminal of `columns` characters; 0 = as if it were none.
  ProgressBar(std::string label, std::size_t total, std::string unit, std::FILE* stream, std::size_t columns);
  /// Calls finish().
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void advance(std::size_t n = 1);
  /// A short remark that is shown from the next redraw on; empty = none.
  void set_note(std::string note);
  /// Writes the closing line and ends it. May be called more than once.
  void finish();

  /// Wipes the bar that is being drawn, if there is one, so that another line can be written in its place.
  /// The bar comes back with its next redraw. For the logger.
  static void hide_drawn_line();

 private:
  using Clock = std::chrono::steady_clock;

  void update_elapsed();
  void draw_bar();
  void print_line();

  std::mutex mutex_;
  ProgressState state_;
  std::FILE* stream_;
  bool terminal_;
  std::size_t columns_;  // 0 = ask the terminal
  bool drawn_ = false;   // a bar stands on the present line
  bool finished_ = false;
  std::size_t last_printed_ = 0;  // steps done at the last plain line
  std::size_t next_line_ = 0;     // steps at which the next plain line is due
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_draw_{};
};

}  // namespace ipl_slam
