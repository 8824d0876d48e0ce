// Clouds: what is read makes sense, and comes back the same from the files that are written of it.
#include "dense/cloud_file.hpp"
#include "user_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ipl_slam;
  const auto file = fuzz::user_file("cloud.ply", data, size);
  fuzz::read_or_refuse([&] {
    const SemanticCloud cloud = read_cloud(file);
    for (const CloudPoint& point : cloud.points) {
      if (!point.position.allFinite() || !point.normal.allFinite()) std::abort();
      if (!(point.confidence >= 0.0F && point.confidence <= 1.0F)) std::abort();
    }
    for (const std::string& bytes : {cloud_ply(cloud), cloud_pcd(cloud)}) {
      const SemanticCloud again = read_cloud(
          fuzz::user_file("again", reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()));
      if (again.points != cloud.points || again.classes != cloud.classes) std::abort();
    }
  });
  return 0;
}
