#include "loop/place_index.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace ipl_slam {
namespace {

constexpr std::size_t kEntriesPerBucket = 3;  // on average
constexpr std::size_t kKeyLength = 32;        // bits, more than there can be buckets for

// Keys are chosen by so many descriptors, those of the first few keyframes: four times as many choose hardly
// better ones.
constexpr std::size_t kLearnFrom = 4096;

// Queries that walk their buckets at the same time, so that one waits for memory while others go on.
constexpr std::size_t kGroup = 16;
using GroupMask = std::uint16_t;

void prefetch(const void* address) {
  __builtin_prefetch(address);
}

}  // namespace

// What a query gathers, per slot.
struct PlaceIndex::Votes {
  std::vector<char> eligible;
  std::size_t eligible_count = 0;
  std::vector<GroupMask> seen;  // queries of the group that were found there
  std::vector<double> weight;
  double total = 0.0;  // weight of all the query's features
};

PlaceIndex::PlaceIndex(const PlaceIndexOptions& options) : options_(options) {
  key_bits_ = choose_key_bits({}, kTables, kKeyLength);
  for (auto& table : buckets_) table.assign(1, kNone);
}

PlaceIndex::Key PlaceIndex::key(const Descriptor& descriptor, std::size_t table) const {
  Key key = 0;
  for (int i = 0; i <= depth_; ++i) {
    const std::uint8_t bit = key_bits_[table][static_cast<std::size_t>(i)];
    key |= static_cast<Key>(descriptor[bit / 64] >> (bit % 64) & 1U) << i;
  }
  return key;
}

// Buckets that were split already are told apart by one bit more.
std::size_t PlaceIndex::bucket(Key key) const {
  const std::size_t wide = key & ((std::size_t{2} << depth_) - 1);
  return wide < buckets_[0].size() ? wide : key & ((std::size_t{1} << depth_) - 1);
}

void PlaceIndex::link(EntryIndex index) {
  Entry& entry = entries_[index];
  for (std::size_t table = 0; table < kTables; ++table) {
    EntryIndex& first = buckets_[table][bucket(key(entry.descriptor, table))];
    entry.next[table] = std::exchange(first, index);
  }
}

void PlaceIndex::unlink(EntryIndex index) {
  const Entry& entry = entries_[index];
  for (std::size_t table = 0; table < kTables; ++table) {
    EntryIndex* at = &buckets_[table][bucket(key(entry.descriptor, table))];
    while (*at != index) at = &entries_[*at].next[table];
    *at = entry.next[table];
  }
}

// Splits the next bucket of each table in two, by the next bit of the key. Entries keep their order.
void PlaceIndex::grow() {
  const std::size_t split = buckets_[0].size() - (std::size_t{1} << depth_);
  for (std::size_t table = 0; table < kTables; ++table) {
    const std::uint8_t bit = key_bits_[table][static_cast<std::size_t>(depth_)];
    buckets_[table].push_back(kNone);
    std::array<EntryIndex*, 2> end = {&buckets_[table][split], &buckets_[table].back()};
    for (EntryIndex at = buckets_[table][split]; at != kNone; at = entries_[at].next[table]) {
      const std::size_t side = entries_[at].descriptor[bit / 64] >> (bit % 64) & 1U;
      *end[side] = at;
      end[side] = &entries_[at].next[table];
    }
    for (EntryIndex* last : end) *last = kNone;
  }
  if (buckets_[0].size() == std::size_t{2} << depth_) ++depth_;
}

// Chooses the keys by what there is, once, and files it all anew.
void PlaceIndex::learn_keys() {
  std::vector<Descriptor> descriptors;
  descriptors.reserve(entries_.size());
  for (const Entry& entry : entries_) descriptors.push_back(entry.descriptor);
  key_bits_ = choose_key_bits(descriptors, kTables, kKeyLength);
  learned_ = true;
  for (auto& table : buckets_) std::fill(table.begin(), table.end(), kNone);
  for (const Member& member : members_) {
    for (const EntryIndex entry : member.entries) link(entry);
  }
}

void PlaceIndex::add(KeyframeId id, std::span<const Descriptor> descriptors) {
  if (id.value >= members_.size()) members_.resize(id.value + std::size_t{1});
  Member& member = members_[id.value];
  if (member.in_index) {
    throw std::invalid_argument(fmt::format("keyframe {} is in the place index already", id.value));
  }
  member.in_index = true;
  member.entries.reserve(descriptors.size());
  ++size_;
  for (const Descriptor& descriptor : descriptors) {
    auto index = static_cast<EntryIndex>(entries_.size());
    if (free_entries_.empty()) {
      entries_.emplace_back();
    } else {
      index = free_entries_.back();
      free_entries_.pop_back();
    }
    entries_[index] = {descriptor, id, {}};
    member.entries.push_back(index);
    link(index);
    const std::size_t count = entries_.size() - free_entries_.size();
    if (count > buckets_[0].size() * kEntriesPerBucket) grow();
  }
  if (!learned_ && entries_.size() >= kLearnFrom) learn_keys();
}

void PlaceIndex::remove(KeyframeId id) {
  if (id.value >= members_.size() || !members_[id.value].in_index) return;
  for (const EntryIndex index : members_[id.value].entries) {
    unlink(index);
    free_entries_.push_back(index);
  }
  members_[id.value] = {};
  --size_;
}

// Finds the keyframes that have each of a group's descriptors. All buckets of the group are walked side by
// side, one step each in turn.
void PlaceIndex::vote(std::span<const Descriptor> group, Votes& votes) const {
  struct Walk {
    std::uint32_t member, table;
    EntryIndex at;
  };
  std::vector<Walk> walks;
  for (std::size_t i = 0; i < group.size(); ++i) {
    for (std::size_t table = 0; table < kTables; ++table) {
      const EntryIndex first = buckets_[table][bucket(key(group[i], table))];
      if (first == kNone) continue;
      prefetch(&entries_[first]);
      walks.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(table), first});
    }
  }
  struct Match {
    std::uint32_t member, keyframe;
  };
  std::vector<Match> matches;
  std::array<int, kGroup> found{};
  for (int step = 0; step < options_.max_bucket && !walks.empty(); ++step) {
    std::size_t kept = 0;
    for (const Walk& walk : walks) {
      const Entry& entry = entries_[walk.at];
      const std::uint32_t keyframe = entry.keyframe.value;
      const auto mark = static_cast<GroupMask>(1U << walk.member);
      if (votes.eligible[keyframe] && !(votes.seen[keyframe] & mark) &&
          hamming_distance(group[walk.member], entry.descriptor) <= options_.max_distance) {
        votes.seen[keyframe] |= mark;
        ++found[walk.member];
        matches.push_back({walk.member, keyframe});
      }
      const EntryIndex next = entry.next[walk.table];
      if (next == kNone) continue;
      prefetch(&entries_[next]);
      walks[kept++] = {walk.member, walk.table, next};
    }
    walks.resize(kept);
  }
  std::array<double, kGroup> weight{};
  for (std::size_t i = 0; i < group.size(); ++i) {
    const double idf = std::log((1.0 + static_cast<double>(votes.eligible_count)) / std::max(found[i], 1));
    weight[i] = idf * idf;
    votes.total += weight[i];
  }
  for (const Match& match : matches) {
    votes.weight[match.keyframe] += weight[match.member];
    votes.seen[match.keyframe] = 0;
  }
}

std::vector<PlaceCandidate> PlaceIndex::query(std::span<const Descriptor> descriptors,
                                              const std::function<bool(KeyframeId)>& eligible) const {
  Votes votes;
  votes.eligible.resize(members_.size());
  votes.seen.resize(members_.size());
  votes.weight.resize(members_.size());
  for (std::uint32_t i = 0; i < members_.size(); ++i) {
    votes.eligible[i] = members_[i].in_index && eligible(KeyframeId{i});
    votes.eligible_count += votes.eligible[i] ? 1 : 0;
  }
  for (std::size_t begin = 0; begin < descriptors.size(); begin += kGroup) {
    vote(descriptors.subspan(begin, std::min(kGroup, descriptors.size() - begin)), votes);
  }
  std::vector<PlaceCandidate> candidates;
  for (std::uint32_t i = 0; i < members_.size(); ++i) {
    if (votes.weight[i] > 0.0) candidates.push_back({KeyframeId{i}, votes.weight[i] / votes.total});
  }
  const auto better = [](const PlaceCandidate& a, const PlaceCandidate& b) {
    return a.score != b.score ? a.score > b.score : a.keyframe < b.keyframe;
  };
  const std::size_t count = std::min(candidates.size(), static_cast<std::size_t>(options_.max_candidates));
  std::partial_sort(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(count),
                    candidates.end(), better);
  candidates.resize(count);
  return candidates;
}

}  // namespace ipl_slam
