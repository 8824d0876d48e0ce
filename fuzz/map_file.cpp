// The loader of map files. Its checksums would keep every change out, so the mutator changes the content of
// one section and packs them anew; now and then it leaves the checksums wrong.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "map/map_bytes.hpp"
#include "support/eventful_map.hpp"

using namespace ipl_slam;

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

std::string_view text(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// Of what is no map file, those of a small map.
std::vector<std::string> sections_of(std::string_view bytes) {
  static const std::string seed = encode_map(test::eventful_map(7, 4, 2), test::kTestCamera);
  std::vector<std::string_view> contents;
  try {
    contents = unpack_sections(map_format(), bytes);
  } catch (const FormatError&) {
    contents = unpack_sections(map_format(), seed);
  }
  return {contents.begin(), contents.end()};
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned int seed) {
  constexpr unsigned kLeftWrong = 32;
  if (seed % kLeftWrong == 0) return LLVMFuzzerMutate(data, size, max_size);
  std::vector<std::string> contents = sections_of(text(data, size));
  std::string& content = contents[seed / kLeftWrong % contents.size()];
  const std::size_t old_size = content.size();
  constexpr std::size_t kGrowth = 256;
  content.resize(old_size + kGrowth);
  content.resize(LLVMFuzzerMutate(reinterpret_cast<std::uint8_t*>(content.data()), old_size, content.size()));
  const std::string packed = pack_sections(map_format(), contents);
  if (packed.size() > max_size) return size;
  std::copy(packed.begin(), packed.end(), data);
  return packed.size();
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const SavedMap loaded = decode_map(text(data, size));
    // What is accepted is a whole map: it comes out as it went in, and can be worked on.
    if (encode_map(loaded.map, loaded.camera) != text(data, size)) std::abort();
    loaded.map.keyframes().for_each([&](KeyframeId id, const Keyframe&) { (void)loaded.map.covisible(id); });
  } catch (const FormatError& error) {
    if (std::strchr(error.what(), '\n') != nullptr) std::abort();
  }
  return 0;
}
