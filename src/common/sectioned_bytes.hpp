#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/byte_stream.hpp"

namespace ipl_slam {

/// What the head of a file of sections says.
struct SectionedFormat {
  std::string_view magic;             ///< its first 8 bytes
  std::uint32_t version = 1;          ///< the one that is written, and the only one that is read
  std::string_view kind;              ///< for messages: "map"
  std::vector<std::string> sections;  ///< names of 4 characters, in their order
};

/// Bytes of the head.
inline constexpr std::size_t kSectionedHead = 28;

/// A file of sections, each with its size and CRC-32, behind a head with version, size and CRC-32: whatever
/// bit of it is changed or missing, unpack_sections notices.
///
///   magic (8 bytes), u32 version, u32 sections, u64 size of the whole, u32 CRC-32 of these 24 bytes
///   per section: name (4 bytes), u64 size of the content, u32 CRC-32 of name, size and content, content
[[nodiscard]] std::string pack_sections(const SectionedFormat& format, std::span<const std::string> contents);

/// The contents, which point into `bytes`. Throws FormatError.
[[nodiscard]] std::vector<std::string_view> unpack_sections(const SectionedFormat& format,
                                                            std::string_view bytes);

/// Checks the head alone, given the first bytes of a file and its size. Throws FormatError.
void check_head(const SectionedFormat& format, std::string_view first_bytes, std::uint64_t size);

}  // namespace ipl_slam
