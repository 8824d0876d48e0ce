#include "dataset/camera_config.hpp"
#include "user_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ipl_slam;
  const auto file = fuzz::user_file("camera.yaml", data, size);
  fuzz::read_or_refuse([&] { load_camera(file.string()).check(); });
  return 0;
}
