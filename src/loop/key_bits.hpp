#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "features/features.hpp"

namespace ipl_slam {

/// The bits of a descriptor that make up the key of a hash table, the most telling first.
using KeyBits = std::vector<std::uint8_t>;

/// Chooses bits for `tables` keys of `length` bits each, no bit in two keys: what a few thousand descriptors
/// show suffices. The bits of ORB are far from fair coins (a corner's orientation points to its brighter
/// side, so many tests nearly always come out alike) and far from independent; keys of bits picked blindly
/// crowd most descriptors into few buckets.
///
/// The keys take turns, and each takes the bit that is least known beforehand: least (1 - 2 p)^2 + sum of
/// phi^2, where p is how often the bit is set and phi its correlation with each bit the key already has.
/// Descriptors of no or one kind give some choice, too. Needs tables * length <= 256
/// (std::invalid_argument).
[[nodiscard]] std::vector<KeyBits> choose_key_bits(std::span<const Descriptor> descriptors,
                                                   std::size_t tables, std::size_t length);

}  // namespace ipl_slam
