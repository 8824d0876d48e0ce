// Feeds the library frame by frame. The pictures are made here: a camera moves sideways, 1 cm per frame, past
// a wall of random tiles 2 m away. Put the frames of your own camera in their place.
#include <cstdint>
#include <cstdio>
#include <vector>

#include <ipl_slam/slam.hpp>

int main() {
  ipl_slam::CameraParameters camera;  // 640 x 480, fx = fy = 525; depth in units of 1/5000 m
  ipl_slam::Slam slam(camera);
  std::vector<std::uint8_t> gray(640 * 480);
  std::vector<std::uint16_t> depth(640 * 480, 2 * 5000);

  for (int frame = 0; frame < 30; ++frame) {
    const double camera_x = 0.01 * frame;  // metres
    for (int v = 0; v < 480; ++v) {
      for (int u = 0; u < 640; ++u) {
        const auto tile_x =
            static_cast<std::uint32_t>(((u - camera.cx) / camera.fx * 2 + camera_x + 9) / 0.04);
        gray[v * 640 + u] = static_cast<std::uint8_t>((tile_x * 2654435761U ^ (v / 11) * 2246822519U) >> 21);
      }
    }
    const auto result =
        slam.process({gray.data(), 640, 480, 0, ipl_slam::PixelFormat::kGray8},
                     {depth.data(), 640, 480, 0, ipl_slam::PixelFormat::kDepth16}, frame / 30.0);
    std::printf("frame %2d: %s, x = %+.3f m\n", frame, to_string(result.state), result.T_wc.tx);
    for (const ipl_slam::SeenInstance& who : result.instances) {  // nobody in this picture
      std::printf("  %s #%u, %s\n", who.class_name.c_str(), who.id, to_string(who.state));
    }
  }
  slam.save_trajectory("trajectory.txt");
}
