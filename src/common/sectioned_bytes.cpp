#include "common/sectioned_bytes.hpp"

#include <stdexcept>

#include <fmt/format.h>
#include <zlib.h>

namespace ipl_slam {
namespace {

constexpr std::size_t kName = 4, kChecksum = 4, kSectionHead = kName + 8 + kChecksum;

std::uint32_t crc32_of(std::string_view bytes, std::uint32_t start = 0) {
  return static_cast<std::uint32_t>(
      crc32_z(start, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

[[noreturn]] void fail_damaged(const std::string& what) {
  throw FormatError(fmt::format("is damaged: {}; copy or save it again", what));
}

}  // namespace

std::string pack_sections(const SectionedFormat& format, std::span<const std::string> contents) {
  if (contents.size() != format.sections.size()) throw std::invalid_argument("pack_sections: other sections");
  std::uint64_t size = kSectionedHead;
  for (const std::string& content : contents) size += kSectionHead + content.size();
  ByteWriter writer;
  writer.put(format.magic);
  writer.put(format.version);
  writer.put(static_cast<std::uint32_t>(contents.size()));
  writer.put(size);
  writer.put(crc32_of(writer.bytes()));
  for (std::size_t i = 0; i < contents.size(); ++i) {
    ByteWriter head;
    head.put(std::string_view(format.sections[i]));
    head.put(static_cast<std::uint64_t>(contents[i].size()));
    writer.put(std::string_view(head.bytes()));
    writer.put(crc32_of(contents[i], crc32_of(head.bytes())));
    writer.put(std::string_view(contents[i]));
  }
  return writer.take();
}

void check_head(const SectionedFormat& format, std::string_view first_bytes, std::uint64_t size) {
  const std::string_view start = first_bytes.substr(0, format.magic.size());
  if (start.empty() || start != format.magic.substr(0, start.size())) {
    throw FormatError(fmt::format("is no {0} file of ipl_slam; give a {0} file", format.kind));
  }
  if (first_bytes.size() < kSectionedHead) {
    throw FormatError(fmt::format("is cut short: {} bytes; copy or save it again", size));
  }
  ByteReader reader(first_bytes);
  (void)reader.get_bytes(format.magic.size());
  const auto version = reader.get<std::uint32_t>();
  if (version > format.version) {
    throw FormatError(
        fmt::format("is a {} of format version {}, but this program reads version {}; use a newer ipl_slam",
                    format.kind, version, format.version));
  }
  const auto sections = reader.get<std::uint32_t>();
  const auto said = reader.get<std::uint64_t>();
  const std::string_view head = first_bytes.substr(0, kSectionedHead - kChecksum);
  if (reader.get<std::uint32_t>() != crc32_of(head)) fail_damaged("the checksum of its head does not match");
  if (version != format.version || sections != format.sections.size()) {
    fail_damaged(fmt::format("its head says version {} with {} sections", version, sections));
  }
  if (size < said) {
    throw FormatError(fmt::format("is cut short: {} of {} bytes; copy or save it again", size, said));
  }
  if (size > said) fail_damaged(fmt::format("{} bytes follow its end", size - said));
}

std::vector<std::string_view> unpack_sections(const SectionedFormat& format, std::string_view bytes) {
  check_head(format, bytes, bytes.size());
  ByteReader reader(bytes);
  (void)reader.get_bytes(kSectionedHead);
  std::vector<std::string_view> contents;
  for (const std::string& name : format.sections) {
    if (reader.remaining() < kSectionHead) fail_damaged(fmt::format("section {} is missing", name));
    const std::string_view head = bytes.substr(reader.position(), kSectionHead - kChecksum);
    const bool named = reader.get_bytes(kName) == name;
    const auto size = reader.get<std::uint64_t>();
    const auto checksum = reader.get<std::uint32_t>();
    if (!named || size > reader.remaining())
      fail_damaged(fmt::format("section {} does not begin where it should", name));
    contents.push_back(reader.get_bytes(size));
    if (crc32_of(contents.back(), crc32_of(head)) != checksum) {
      fail_damaged(fmt::format("the checksum of section {} does not match", name));
    }
  }
  if (reader.remaining() > 0)
    fail_damaged(fmt::format("{} bytes follow its last section", reader.remaining()));
  return contents;
}

}  // namespace ipl_slam
