#include "dataset/trajectory.hpp"

#include "user_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ipl_slam;
  const auto file = fuzz::user_file("trajectory.txt", data, size);
  fuzz::read_or_refuse([&] {
    const Trajectory trajectory = read_trajectory(file);
    for (std::size_t i = 1; i < trajectory.size(); ++i) {
      if (!(trajectory[i - 1].timestamp < trajectory[i].timestamp)) std::abort();
    }
  });
  return 0;
}
