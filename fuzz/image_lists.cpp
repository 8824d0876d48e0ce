#include "dataset/image_list.hpp"
#include "user_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ipl_slam;
  const auto file = fuzz::user_file("rgb.txt", data, size);
  fuzz::read_or_refuse([&] { (void)read_image_list(file); });
  fuzz::read_or_refuse([&] { (void)read_associations(file); });
  return 0;
}
