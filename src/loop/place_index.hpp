#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <span>
#include <vector>

#include "common/ids.hpp"
#include "common/options.hpp"
#include "features/features.hpp"
#include "loop/key_bits.hpp"

namespace ipl_slam {

struct PlaceIndexOptions {
  int max_candidates = 10;
  int max_distance = 40;
  int max_bucket = 256;

  template <class Visitor>
  void visit(Visitor& v) {
    v.number("max_candidates", max_candidates, {1, 1000, "count", "keyframes a query returns at most"});
    v.number("max_distance", max_distance,
             {0, 256, "bits", "descriptors that differ by more do not show the same"});
    v.number("max_bucket", max_bucket,
             {1, 1000000, "count",
              "descriptors of one bucket that a query looks at, the newest: what is in larger ones is too "
              "common to say much"});
  }
};

/// A keyframe that may show what was asked for.
struct PlaceCandidate {
  KeyframeId keyframe;
  double score = 0.0;  ///< share of what the query's features tell that is found there, 0 to 1
};

/// Finds the keyframes that look like a picture by its binary descriptors, without a vocabulary file. The
/// same calls give the same answers, to the bit.
///
/// Locality-sensitive hashing of binary codes (Indyk and Motwani, STOC 1998): each of kTables hash tables
/// files a descriptor under some of its bits, no bit in two tables. Two sights of a corner differ in 10 to
/// 20 % of the bits, so they are likely to agree on the bits of at least one table; what shares a bucket with
/// the query's descriptor is then compared in full. The tables grow with the number of descriptors, bucket by
/// bucket (linear hashing: Litwin, VLDB 1980), by one more bit of the key: there is never a pause for
/// rehashing. A descriptor takes up 64 bytes, one cache line, its places in the tables some 9 to 19 more.
///
/// A feature of the query that is found in n of the N eligible keyframes counts log((1 + N) / n)^2 for each
/// of them (inverse document frequency, once for the query and once for the keyframe: Sivic and Zisserman,
/// "Video Google", ICCV 2003).
class PlaceIndex {
 public:
  explicit PlaceIndex(const PlaceIndexOptions& options);

  /// `descriptors`: of the keyframe's static features. Throws std::invalid_argument where the keyframe is in
  /// the index already.
  void add(KeyframeId id, std::span<const Descriptor> descriptors);
  /// Does nothing where the keyframe is not in the index.
  void remove(KeyframeId id);
  /// The most similar keyframes among those `eligible` allows, best first, then by id; none that have
  /// nothing in common with the query.
  [[nodiscard]] std::vector<PlaceCandidate> query(std::span<const Descriptor> descriptors,
                                                  const std::function<bool(KeyframeId)>& eligible) const;
  /// Keyframes in the index.
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  static constexpr std::size_t kTables = 7;  // as many as make an entry one cache line
  using EntryIndex = std::uint32_t;
  static constexpr EntryIndex kNone = ~EntryIndex{0};

  /// A descriptor and, per table, the next one in its bucket.
  struct alignas(64) Entry {
    Descriptor descriptor;
    KeyframeId keyframe;
    std::array<EntryIndex, kTables> next;
  };
  struct Member {
    bool in_index = false;
    std::vector<EntryIndex> entries;
  };
  using Key = std::uint32_t;
  struct Votes;

  [[nodiscard]] Key key(const Descriptor& descriptor, std::size_t table) const;
  [[nodiscard]] std::size_t bucket(Key key) const;
  void link(EntryIndex entry);
  void unlink(EntryIndex entry);
  void grow();
  void learn_keys();
  void vote(std::span<const Descriptor> group, Votes& votes) const;

  PlaceIndexOptions options_;
  std::vector<KeyBits> key_bits_;                         // per table
  bool learned_ = false;                                  // whether they were chosen by what was seen
  std::array<std::vector<EntryIndex>, kTables> buckets_;  // per table and bucket: its first entry
  int depth_ = 0;                                         // bits of the key of the buckets not yet split
  std::deque<Entry> entries_;
  std::vector<EntryIndex> free_entries_;
  std::vector<Member> members_;  // by keyframe id
  std::size_t size_ = 0;
};

}  // namespace ipl_slam
