#pragma once

#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "dataset/temporary_folder.hpp"

namespace ipl_slam::testing {

/// What a program left behind: 128 + n as exit code where signal n ended it.
struct Finished {
  int code = -1;
  std::string out, err;
};

/// Runs a program with its output in files, as in a script: stdout is no terminal. `meanwhile` is called with
/// the process and the file its stdout goes to while it runs.
inline Finished run_program(const std::vector<std::string>& words,
                            const std::function<void(pid_t, const std::filesystem::path&)>& meanwhile = {},
                            const std::string& out_file = {}) {
  const TemporaryFolder folder;
  const std::string out = out_file.empty() ? (folder / "out").string() : out_file;
  const std::string err = (folder / "err").string();
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);

  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("cannot start a process");
  if (child == 0) {
    // A shell that starts jobs in the background, as a test runner may, has them ignore Ctrl-C.
    std::signal(SIGINT, SIG_DFL);
    if (::dup2(::open(out.c_str(), O_WRONLY | O_CREAT, 0666), STDOUT_FILENO) < 0) std::_Exit(126);
    if (::dup2(::open(err.c_str(), O_WRONLY | O_CREAT, 0666), STDERR_FILENO) < 0) std::_Exit(126);
    ::execv(arguments[0], arguments.data());
    std::_Exit(127);
  }
  if (meanwhile) meanwhile(child, out);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0) {
  }
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
          out_file.empty() ? content_of(out) : std::string(), content_of(err)};
}

/// Runs ipl_slam, which lies where the build put it.
inline Finished ipl_slam_program(std::vector<std::string> words) {
  words.insert(words.begin(), IPL_SLAM_PROGRAM);
  return run_program(words);
}

/// The same with Ctrl-C as soon as `seen` stands in its output.
inline Finished interrupt_ipl_slam(std::vector<std::string> words, const std::string& seen) {
  words.insert(words.begin(), IPL_SLAM_PROGRAM);
  return run_program(words, [&](pid_t process, const std::filesystem::path& out) {
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (content_of(out).find(seen) == std::string::npos && std::chrono::steady_clock::now() < give_up) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    ::kill(process, SIGINT);
  });
}

}  // namespace ipl_slam::testing
