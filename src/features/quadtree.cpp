#include "features/quadtree.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace ipl_slam {
namespace {

// A part of the area and the corners inside it, as a range of the shared index list.
struct Part {
  int x, y, width, height;
  int begin, end;

  [[nodiscard]] int count() const { return end - begin; }
  [[nodiscard]] bool splits() const { return count() > 1 && (width > 1 || height > 1); }
};

// Moves the indices of [begin, end) for which `below` holds to the front, keeping their order; returns the
// boundary.
template <class Below>
int divide(std::vector<int>& indices, std::vector<int>& scratch, int begin, int end, const Below& below) {
  int front = begin;
  std::size_t kept = 0;
  for (int i = begin; i < end; ++i) {
    const int index = indices[static_cast<std::size_t>(i)];
    if (below(index)) {
      indices[static_cast<std::size_t>(front++)] = index;
    } else {
      scratch[kept++] = index;
    }
  }
  std::copy_n(scratch.begin(), kept, indices.begin() + front);
  return front;
}

class Tree {
 public:
  Tree(std::span<const Corner> corners, const cv::Rect& area)
      : corners_(corners), indices_(corners.size()), scratch_(corners.size()) {
    std::iota(indices_.begin(), indices_.end(), 0);
    // Begin with parts that are nearly square.
    const int columns =
        std::max(1, static_cast<int>(std::lround(static_cast<double>(area.width) / area.height)));
    int begin = 0;
    for (int i = 0; i < columns; ++i) {
      const int x = area.x + area.width * i / columns;
      const int right = area.x + area.width * (i + 1) / columns;
      const int end = divide(indices_, scratch_, begin, static_cast<int>(corners.size()),
                             [&](int c) { return corner(c).x < right; });
      if (end > begin) parts_.push_back({x, area.y, right - x, area.height, begin, end});
      begin = end;
    }
  }

  void split_until(int quota) {
    while (static_cast<int>(parts_.size()) < quota) {
      std::vector<Part> open;
      std::vector<Part> closed;
      for (const Part& part : parts_) (part.splits() ? open : closed).push_back(part);
      if (open.empty()) return;
      std::sort(open.begin(), open.end(), [](const Part& a, const Part& b) {
        return std::tuple(-a.count(), a.y, a.x) < std::tuple(-b.count(), b.y, b.x);
      });
      parts_ = std::move(closed);
      std::size_t next = 0;
      while (next < open.size() && static_cast<int>(parts_.size() + open.size() - next) < quota) {
        const std::size_t children = parts_.size();
        split(open[next++]);
        drop_weakest(children, parts_.size() + open.size() - next, static_cast<std::size_t>(quota));
      }
      parts_.insert(parts_.end(), open.begin() + static_cast<std::ptrdiff_t>(next), open.end());
    }
  }

  [[nodiscard]] std::vector<int> strongest_of_each() const {
    std::vector<int> best;
    best.reserve(parts_.size());
    for (const Part& part : parts_) best.push_back(strongest(part));
    return best;
  }

 private:
  [[nodiscard]] const Corner& corner(int i) const { return corners_[static_cast<std::size_t>(i)]; }

  [[nodiscard]] int strongest(const Part& part) const {
    int best = indices_[static_cast<std::size_t>(part.begin)];
    for (int i = part.begin + 1; i < part.end; ++i) {
      const int c = indices_[static_cast<std::size_t>(i)];
      if (corner(c).score > corner(best).score) best = c;
    }
    return best;
  }

  // The last split may give up to three parts too many: the weakest of its own go, never a lonely corner
  // elsewhere.
  void drop_weakest(std::size_t children, std::size_t total, std::size_t quota) {
    for (; total > quota; --total) {
      const auto weaker = [this](const Part& a, const Part& b) {
        return corner(strongest(a)).score < corner(strongest(b)).score;
      };
      parts_.erase(
          std::min_element(parts_.begin() + static_cast<std::ptrdiff_t>(children), parts_.end(), weaker));
    }
  }

  void split(const Part& p) {
    const int left = (p.width + 1) / 2;
    const int top = (p.height + 1) / 2;
    const int middle =
        divide(indices_, scratch_, p.begin, p.end, [&](int c) { return corner(c).y < p.y + top; });
    const auto is_left = [&](int c) { return corner(c).x < p.x + left; };
    const int upper = divide(indices_, scratch_, p.begin, middle, is_left);
    const int lower = divide(indices_, scratch_, middle, p.end, is_left);
    const Part children[4] = {{p.x, p.y, left, top, p.begin, upper},
                              {p.x + left, p.y, p.width - left, top, upper, middle},
                              {p.x, p.y + top, left, p.height - top, middle, lower},
                              {p.x + left, p.y + top, p.width - left, p.height - top, lower, p.end}};
    for (const Part& child : children) {
      if (child.count() > 0) parts_.push_back(child);
    }
  }

  std::span<const Corner> corners_;
  std::vector<int> indices_;
  std::vector<int> scratch_;
  std::vector<Part> parts_;
};

// Brings the `count` strongest of `indices` to the front, the first in reading order among equals.
void keep_strongest(std::span<const Corner> corners, std::vector<int>& indices, int count) {
  if (static_cast<int>(indices.size()) <= count) return;
  const auto stronger = [&corners](int a, int b) {
    const int score_a = corners[static_cast<std::size_t>(a)].score;
    const int score_b = corners[static_cast<std::size_t>(b)].score;
    return score_a != score_b ? score_a > score_b : a < b;
  };
  std::nth_element(indices.begin(), indices.begin() + count, indices.end(), stronger);
  indices.resize(static_cast<std::size_t>(count));
}

}  // namespace

std::vector<int> spread_evenly(std::span<const Corner> corners, const cv::Rect& area, int quota,
                               double spread) {
  if (quota <= 0 || corners.empty()) return {};
  std::vector<int> all(corners.size());
  std::iota(all.begin(), all.end(), 0);
  if (static_cast<int>(corners.size()) <= quota) return all;

  std::vector<int> chosen;
  const int even = static_cast<int>(std::lround(quota * spread));
  if (even > 0) {
    Tree tree(corners, area);
    tree.split_until(even);
    chosen = tree.strongest_of_each();
    keep_strongest(corners, chosen, even);  // more than that only where the first parts are already more
  }
  std::vector<std::uint8_t> taken(corners.size(), 0);
  for (const int i : chosen) taken[static_cast<std::size_t>(i)] = 1;
  std::erase_if(all, [&taken](int i) { return taken[static_cast<std::size_t>(i)] != 0; });
  keep_strongest(corners, all, quota - static_cast<int>(chosen.size()));
  chosen.insert(chosen.end(), all.begin(), all.end());
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

}  // namespace ipl_slam
