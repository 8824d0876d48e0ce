#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "common/interrupt.hpp"
#include "common/log.hpp"
#include "common/progress.hpp"
#include "dataset/synthetic/synthetic_source.hpp"
#include "dataset/synthetic/write_sequence.hpp"
#include "output.hpp"
#include "verbs.hpp"

namespace ipl_slam::cli {
namespace {

/// Ends write_sequence early, which then takes away what it has written.
struct Interrupted {};

struct SynthArguments {
  std::string folder;
  SyntheticOptions options;
  SequenceWriteOptions write;
  bool no_noise = false;
};

// The command that draws the same sequence again; settings at their defaults are spelled out all the same.
std::string command_of(const SynthArguments& a) {
  const SyntheticOptions& o = a.options;
  std::string command = fmt::format(
      "ipl_slam synth OUT_DIR --scene {} --trajectory {} --story {} --clothes {} --seed {} --frames {} --fps "
      "{} --width {} --height "
      "{} "
      "--people {} --boxes {} --motion-blur {} --exposure {} --max-depth {}",
      o.scene, o.trajectory, o.story, o.clothes, o.seed, o.frames, o.fps, o.width, o.height, o.people,
      o.boxes, o.motion_blur, o.exposure, o.depth_sensor.max_range);
  if (a.no_noise) command += " --no-noise";
  return command;
}

void run_synth(SynthArguments& a) {
  if (a.no_noise) a.options.color_noise = a.options.depth_noise = false;
  a.write.made_by = command_of(a);
  const auto start = std::chrono::steady_clock::now();
  const SyntheticSource source(a.options);
  std::optional<ProgressBar> bar;
  if (says_remarks()) bar.emplace("rendering", source.size());
  a.write.frame_done = [&bar] {
    if (bar) bar->advance();
    if (interrupted()) throw Interrupted{};
  };
  install_interrupt_handler();
  try {
    write_sequence(source, a.folder, a.write);
  } catch (const Interrupted&) {
    log().warn("interrupted; {} was not written", a.folder);
    exit_code() = kInterrupted;
    return;
  }
  bar.reset();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  fmt::print("{}: {} frames of {}x{} in {:.1f} s\n", a.folder, source.size(), a.options.width,
             a.options.height, took.count());
}

}  // namespace

void add_synth_verb(CLI::App& app) {
  auto a = std::make_shared<SynthArguments>();
  CLI::App* verb =
      app.add_subcommand("synth", "Render an RGB-D sequence with exact ground truth and object masks");
  SyntheticOptions& o = a->options;
  verb->add_option("OUT_DIR", a->folder, "Folder to create, in the layout of the TUM RGB-D benchmark")
      ->required();
  verb->add_option("--scene", o.scene,
                   "What is drawn: room (furnished), white_room or corridor (edges, hardly any corners), "
                   "building (eight furnished rooms) or doors (corridors of look-alike doors)")
      ->capture_default_str();
  verb->add_option("--trajectory", o.trajectory,
                   "Path of the camera: orbit, sweep (neither fits the corridor), walk, xyz, rpy, halfsphere "
                   "or static; loop (and no other) in the scenes building and doors")
      ->capture_default_str();
  verb->add_option(
          "--story", o.story,
          "What happens in the scene room: walk (people walk, stop, sit, leave and return; boxes are "
          "pushed about), or close before a camera that moves on xyz, rpy, halfsphere or static: "
          "stand (everybody stands still), crowd (people walk round and hide most of the room), "
          "enter, leave, push (the first box is big, stands still for a third of the time, then "
          "moves)")
      ->capture_default_str();
  verb->add_option("--clothes", o.clothes, "What people wear: plain, or printed (full of corners)")
      ->capture_default_str();
  verb->add_option("--frames", o.frames, "Number of frames")->capture_default_str();
  verb->add_option("--fps", o.fps, "Frames per second")->capture_default_str();
  verb->add_option("--width", o.width, "Image width, pixels")->capture_default_str();
  verb->add_option("--height", o.height, "Image height, pixels")->capture_default_str();
  verb->add_option("--seed", o.seed, "Everything random depends on it: same seed, same bytes")
      ->capture_default_str();
  verb->add_option("--people", o.people,
                   "People in the scenes room (who do what the story says), building and doors")
      ->capture_default_str();
  verb->add_option("--boxes", o.boxes,
                   "Rigid moving things in the scene room: a box pushed about, the door, more boxes")
      ->capture_default_str();
  verb->add_option("--motion-blur", o.motion_blur, "Renderings averaged over the exposure; 1 = no blur")
      ->capture_default_str();
  verb->add_option("--exposure", o.exposure, "Exposure time in seconds, with --motion-blur above 1")
      ->capture_default_str();
  verb->add_option("--max-depth", o.depth_sensor.max_range, "Range of the depth camera, metres")
      ->capture_default_str();
  verb->add_flag("--no-noise", a->no_noise, "Exact depth and clean color, no holes and no range limit");
  verb->add_option("--threads", a->write.threads, "Threads; 0 = one per core. Does not change the result")
      ->capture_default_str();
  verb->add_flag("--force", a->write.overwrite, "Replace OUT_DIR if it is a sequence rendered before");
  verb->callback([a] { run_synth(*a); });
}

}  // namespace ipl_slam::cli
