#include "common/progress.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace ipl_slam {
namespace {

constexpr std::chrono::milliseconds kRedrawInterval(100);
constexpr std::size_t kShortestBar = 10, kLongestBar = 40;
constexpr std::size_t kFirstLineWithoutTotal = 100;

// The bar that has a line on a terminal, for hide_drawn_line(). Locked before a bar's own mutex is, never
// after it.
std::mutex g_active_mutex;
ProgressBar* g_active = nullptr;

std::size_t terminal_columns(std::FILE* stream) {
  winsize size{};
  if (ioctl(fileno(stream), TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  return 80;
}

std::size_t first_line_at(std::size_t total) {
  return total > 0 ? std::max<std::size_t>(1, (total + 9) / 10) : kFirstLineWithoutTotal;
}

}  // namespace

double ProgressState::rate() const {
  return elapsed_s > 0.0 ? static_cast<double>(done) / elapsed_s : 0.0;
}

std::string format_duration(double seconds) {
  const auto s = static_cast<long long>(std::llround(std::clamp(seconds, 0.0, 1e9)));
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3600) return fmt::format("{} min {:02} s", s / 60, s % 60);
  return fmt::format("{} h {:02} min", s / 3600, s % 3600 / 60);
}

std::string progress_text(const ProgressState& state) {
  std::string text = state.total > 0 ? fmt::format("{}/{} {}", state.done, state.total, state.unit)
                                     : fmt::format("{} {}", state.done, state.unit);
  const double rate = state.rate();
  if (rate > 0.0) text += fmt::format(", {:.1f} {}/s", rate, state.unit);
  if (rate > 0.0 && state.done < state.total) {
    text += fmt::format(", ETA {}", format_duration(static_cast<double>(state.total - state.done) / rate));
  }
  if (!state.note.empty()) text += ", " + state.note;
  return state.label + ' ' + text;
}

std::string progress_line(const ProgressState& state, std::size_t width) {
  const std::string text = progress_text(state);
  const std::size_t frame = 3;  // brackets and a space
  if (state.total > 0 && width >= text.size() + frame + kShortestBar) {
    const std::size_t bar = std::min(kLongestBar, width - text.size() - frame);
    const std::size_t filled = bar * std::min(state.done, state.total) / state.total;
    std::string drawn(filled, '#');
    if (filled < bar) drawn += '>';
    drawn.resize(bar, ' ');
    return fmt::format("{} [{}]{}", state.label, drawn, text.substr(state.label.size()));
  }
  return text.substr(0, width);
}

ProgressBar::ProgressBar(std::string label, std::size_t total, std::string unit)
    : ProgressBar(std::move(label), total, std::move(unit), stdout, 0) {
  terminal_ = isatty(fileno(stdout)) == 1;
}

ProgressBar::ProgressBar(std::string label, std::size_t total, std::string unit, std::FILE* stream,
                         std::size_t columns)
    : state_{.label = std::move(label), .unit = std::move(unit), .total = total, .note = {}},
      stream_(stream),
      terminal_(columns > 0),
      columns_(columns),
      next_line_(first_line_at(total)) {
  const std::lock_guard lock(g_active_mutex);
  g_active = this;
}

ProgressBar::~ProgressBar() {
  finish();
  const std::lock_guard lock(g_active_mutex);
  if (g_active == this) g_active = nullptr;
}

void ProgressBar::update_elapsed() {
  state_.elapsed_s = std::chrono::duration<double>(Clock::now() - start_).count();
}

void ProgressBar::advance(std::size_t n) {
  const std::lock_guard lock(mutex_);
  if (finished_) return;
  state_.done += n;
  if (terminal_) {
    if (Clock::now() - last_draw_ >= kRedrawInterval) draw_bar();
  } else if (state_.done >= next_line_) {
    print_line();
  }
}

void ProgressBar::set_note(std::string note) {
  const std::lock_guard lock(mutex_);
  state_.note = std::move(note);
}

void ProgressBar::finish() {
  const std::lock_guard lock(mutex_);
  if (finished_) return;
  finished_ = true;
  if (terminal_) {
    draw_bar();
    std::fputc('\n', stream_);
    std::fflush(stream_);
    drawn_ = false;
  } else if (state_.done != last_printed_) {
    print_line();
  }
}

void ProgressBar::draw_bar() {
  update_elapsed();
  last_draw_ = Clock::now();
  // The last column stays free: some terminals wrap when it is written.
  const std::size_t columns = columns_ > 0 ? columns_ : terminal_columns(stream_);
  fmt::print(stream_, "\r{}\x1b[K", progress_line(state_, columns - 1));
  std::fflush(stream_);
  drawn_ = true;
}

void ProgressBar::print_line() {
  update_elapsed();
  fmt::print(stream_, "{}\n", progress_text(state_));
  std::fflush(stream_);
  last_printed_ = state_.done;
  while (next_line_ <= state_.done) next_line_ += state_.total > 0 ? first_line_at(state_.total) : next_line_;
}

void ProgressBar::hide_drawn_line() {
  const std::lock_guard active_lock(g_active_mutex);
  if (g_active == nullptr) return;
  const std::lock_guard lock(g_active->mutex_);
  if (!g_active->drawn_) return;
  std::fputs("\r\x1b[K", g_active->stream_);
  std::fflush(g_active->stream_);
  g_active->drawn_ = false;
}

}  // namespace ipl_slam
