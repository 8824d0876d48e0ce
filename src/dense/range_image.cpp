#include "dense/range_image.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace ipl_slam {
namespace {

// Pixels. A pose off by 5 mm shifts what lies 1 m away by 2.6 pixels at a focal length of 525.
constexpr int kReachRadius = 2;

// Surfaces are judged on cells of this many pixels a side: the mean of 16 depths has a quarter of their
// noise.
constexpr int kCell = 4;
// Slopes are taken between cells up to this far to either side. A camera with 1.4 mm of noise at 1 m then
// errs by about 3 degrees at 3 m.
constexpr int kSpan = 2;
// Where the slopes to the two sides differ by more than this share of the depth per cell they are of two
// surfaces, with a step between them that a hole hides, and the flatter is taken. Noise at 4 m makes a tenth
// of it, a right-angled corner seen evenly 0.015.
constexpr float kBend = 0.01F;
// Least share of a cell's pixels that must have depth.
constexpr double kLeastFill = 0.5;

// A measurement is off by more standard deviations in 3 of 1000 cases.
constexpr float kNoiseLimit = 3.0F;

constexpr std::uint16_t kNoDepth = std::numeric_limits<std::uint16_t>::max();

int cells_along(int pixels) {
  return (pixels + kCell - 1) / kCell;
}

// Depth images around each pixel, raw units; the nearest is kNoDepth where nothing was measured.
struct Neighbourhood {
  cv::Mat nearest, farthest;  // of the 8 neighbours and the pixel
  cv::Mat reach;              // nearest within kReachRadius
};

Neighbourhood look_around(const cv::Mat& depth) {
  cv::Mat measured(depth.size(), CV_16UC1);
  for (int v = 0; v < depth.rows; ++v) {
    const auto* from = depth.ptr<std::uint16_t>(v);
    auto* to = measured.ptr<std::uint16_t>(v);
    for (int u = 0; u < depth.cols; ++u) to[u] = from[u] == 0 ? kNoDepth : from[u];
  }
  Neighbourhood around;
  cv::erode(measured, around.nearest, {});
  cv::erode(around.nearest, around.reach, {}, {-1, -1}, kReachRadius - 1);
  cv::dilate(depth, around.farthest, {});
  return around;
}

// CV_8UC1: 1 = beside a depth step.
cv::Mat find_edges(const cv::Mat& depth, const Neighbourhood& around, double edge) {
  cv::Mat edges(depth.size(), CV_8UC1);
  const auto limit = static_cast<float>(edge);
  for (int v = 0; v < depth.rows; ++v) {
    const auto* d = depth.ptr<std::uint16_t>(v);
    const auto* nearest = around.nearest.ptr<std::uint16_t>(v);
    const auto* farthest = around.farthest.ptr<std::uint16_t>(v);
    auto* to = edges.ptr<std::uint8_t>(v);
    for (int u = 0; u < depth.cols; ++u) {
      const int here = d[u], behind = farthest[u] - here, before = here - nearest[u];
      const int step = behind > before ? behind : before;
      const bool is_step = static_cast<float>(step) > limit * static_cast<float>(here);
      to[u] = static_cast<std::uint8_t>((here != 0) & is_step);
    }
  }
  return edges;
}

// What was measured in each cell.
struct CellMeans {
  cv::Mat inverse_depth;  // CV_32FC1, mean in 1/m; 0 for cells with an edge or too little depth
  cv::Mat u, v;           // CV_32FC1, mean of the pixels with depth
};

CellMeans cell_means(const cv::Mat& depth, const cv::Mat& edges, double depth_scale) {
  const int columns = cells_along(depth.cols), rows = cells_along(depth.rows);
  CellMeans means{cv::Mat(rows, columns, CV_32FC1), cv::Mat(rows, columns, CV_32FC1),
                  cv::Mat(rows, columns, CV_32FC1)};
  const auto scale = static_cast<float>(depth_scale);
  const auto width = static_cast<std::size_t>(columns * kCell);
  const auto measured_columns = static_cast<std::size_t>(depth.cols);
  std::vector<float> sum(width), count(width), sum_v(width), edge_count(width);
  for (int row = 0; row < rows; ++row) {
    std::fill(sum.begin(), sum.end(), 0.0F);
    for (std::vector<float>* list : {&count, &sum_v, &edge_count})
      std::fill(list->begin(), list->end(), 0.0F);
    for (int v = row * kCell; v < std::min((row + 1) * kCell, depth.rows); ++v) {
      const auto* d = depth.ptr<std::uint16_t>(v);
      const auto* is_edge = edges.ptr<std::uint8_t>(v);
      for (std::size_t u = 0; u < measured_columns; ++u) {
        const auto raw = static_cast<float>(d[u]);
        const float measured = raw > 0.0F ? 1.0F : 0.0F;
        sum[u] += measured * (scale / (raw + 1.0F - measured));
        count[u] += measured;
        sum_v[u] += measured * static_cast<float>(v);
        edge_count[u] += static_cast<float>(is_edge[u]);
      }
    }
    auto* to = means.inverse_depth.ptr<float>(row);
    for (int column = 0; column < columns; ++column) {
      float total = 0.0F, pixels = 0.0F, u_total = 0.0F, v_total = 0.0F, edge_pixels = 0.0F;
      for (int u = column * kCell; u < (column + 1) * kCell; ++u) {
        const auto i = static_cast<std::size_t>(u);
        total += sum[i], pixels += count[i], edge_pixels += edge_count[i];
        u_total += count[i] * static_cast<float>(u), v_total += sum_v[i];
      }
      const bool known = edge_pixels == 0.0F && pixels >= static_cast<float>(kLeastFill * kCell * kCell);
      to[column] = known ? total / pixels : 0.0F;
      means.u.at<float>(row, column) = known ? u_total / pixels : 0.0F;
      means.v.at<float>(row, column) = known ? v_total / pixels : 0.0F;
    }
  }
  return means;
}

// How many cells one can go from `at` (a cell with depth; `stride` leads to the next) without leaving the
// surface: at most kSpan, and `room`.
int span(const float* at, std::ptrdiff_t stride, int room) {
  int n = 0;
  while (n < std::min(kSpan, room) && at[(n + 1) * stride] > 0.0F) ++n;
  return n;
}

// Growth per cell; nothing where the surface is too thin to tell.
std::optional<float> slope(const float* at, std::ptrdiff_t stride, int room_before, int room_behind) {
  const int before = span(at, -stride, room_before), behind = span(at, stride, room_behind);
  const float rise_before = *at - at[-before * stride], rise_behind = at[behind * stride] - *at;
  if (before == 0 && behind == 0) return std::nullopt;
  if (before == 0 || behind == 0) {
    return (rise_before + rise_behind) / static_cast<float>(before + behind);
  }
  const float a = rise_before / static_cast<float>(before), b = rise_behind / static_cast<float>(behind);
  if (std::abs(a - b) > kBend * *at) return std::abs(a) < std::abs(b) ? a : b;
  return (rise_before + rise_behind) / static_cast<float>(before + behind);
}

// A cell's surface.
struct Plane {
  float distance;    // of the camera from the tangent plane, m; 0 = not known
  float at_00;       // inverse depth in the image's pixel (0, 0), if it went on so far, 1/m
  float by_u, by_v;  // growth of inverse depth per pixel, 1/m
  bool slopes_are_known;
};

// One Plane per cell. Inverse depth is linear over the image of a plane: with n . p = D and p = z m, 1/z =
// (n / D) . m. Its derivatives by x and y are thus n_x / D and n_y / D, and |n| = 1 gives D.
std::vector<Plane> cell_planes(const CellMeans& means, const Camera& camera) {
  const cv::Mat& inverse_depth = means.inverse_depth;
  std::vector<Plane> planes(inverse_depth.total(), Plane{});
  const auto down = static_cast<std::ptrdiff_t>(inverse_depth.step1());
  const auto per_x = static_cast<float>(camera.fx / kCell), per_y = static_cast<float>(camera.fy / kCell);
  const int rows = inverse_depth.rows, columns = inverse_depth.cols;
  for (int row = 0; row < rows; ++row) {
    const auto* from = inverse_depth.ptr<float>(row);
    Plane* to = planes.data() + static_cast<std::ptrdiff_t>(row) * columns;
    const auto y = static_cast<float>(((row + 0.5) * kCell - 0.5 - camera.cy) / camera.fy);
    for (int column = 0; column < columns; ++column) {
      const float* at = from + column;
      if (*at == 0.0F) continue;
      const auto x = static_cast<float>(((column + 0.5) * kCell - 0.5 - camera.cx) / camera.fx);
      const std::optional<float> along_row = slope(at, 1, column, columns - 1 - column);
      const std::optional<float> down_column = slope(at, down, row, rows - 1 - row);
      // What is too thin to tell counts as facing the camera.
      const float along = along_row.value_or(0.0F), across = down_column.value_or(0.0F);
      const float nx = along * per_x, ny = across * per_y, nz = *at - x * nx - y * ny;
      const float by_u = along / kCell, by_v = across / kCell;
      const float at_00 = *at - by_u * means.u.at<float>(row, column) - by_v * means.v.at<float>(row, column);
      to[column] = {1.0F / std::sqrt(nx * nx + ny * ny + nz * nz), at_00, by_u, by_v,
                    along_row && down_column};
    }
  }
  return planes;
}

// The distance of the plane of the cell about (row, column) whose depth is most like the pixel's, for pixels
// in cells that have none of their own; 0 where none comes within `limit` of the inverse depth.
float plane_nearby(const std::vector<Plane>& planes, const cv::Mat& inverse_depth, int row, int column,
                   float inverse, float limit) {
  float best = limit * inverse, plane = 0.0F;
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, inverse_depth.rows - 1); ++r) {
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, inverse_depth.cols - 1); ++c) {
      const float distance = planes[static_cast<std::size_t>(r * inverse_depth.cols + c)].distance;
      if (distance == 0.0F) continue;
      const float difference = std::abs(inverse_depth.at<float>(r, c) - inverse);
      if (difference > best) continue;
      best = difference;
      plane = distance;
    }
  }
  return plane;
}

// Depth between what was measured and what the surface about it says, by how likely the difference is noise.
// Noise of a standard deviation s hides detail of the size d: the best guess is s^2 / (s^2 + d^2) of the way
// to the surface (Wiener's filter). What differs by more than noise is detail.
struct Smoother {
  float sigma, detail2;

  [[nodiscard]] float operator()(float metres, const Plane& plane, float u, float v) const {
    const float inverse = plane.at_00 + plane.by_u * u + plane.by_v * v;
    if (!plane.slopes_are_known || inverse <= 0.0F) return metres;
    const float noise = sigma * metres * metres, difference = 1.0F / inverse - metres;
    if (std::abs(difference) > kNoiseLimit * noise) return metres;
    const float noise2 = noise * noise;
    return metres + noise2 / (noise2 + detail2) * difference;
  }
};

// Gives the depth that is to be taken in: 0 where it is not. metres: measured. plane: distance of the tangent
// plane, per pixel.
struct RowFilter {
  const std::vector<float>& x2;  // x^2 of the ray (x, y, 1), per column
  float y2_and_1, max_depth, min_incidence2;

  void operator()(const float* metres, const float* plane, const std::uint8_t* edges, float* depth,
                  float* incidence) const {
    for (std::size_t u = 0; u < x2.size(); ++u) {
      const float seen_at = plane[u] / std::max(metres[u], std::numeric_limits<float>::min());
      const bool flat = seen_at * seen_at < min_incidence2 * (x2[u] + y2_and_1);
      const bool take =
          (metres[u] > 0.0F) & (metres[u] <= max_depth) & (edges[u] == 0) & (plane[u] > 0.0F) & !flat;
      depth[u] = take ? metres[u] : 0.0F;
      incidence[u] = take ? seen_at : 0.0F;
    }
  }
};

}  // namespace

RangeImage make_range_image(const cv::Mat& depth, const cv::Mat& left_out, const Camera& camera,
                            const RangeOptions& options, double depth_sigma) {
  CV_Assert(depth.type() == CV_16UC1 && depth.cols == camera.width && depth.rows == camera.height);
  CV_Assert(left_out.empty() || (left_out.type() == CV_8UC1 && left_out.size() == depth.size()));
  const Neighbourhood around = look_around(depth);
  const cv::Mat edges = find_edges(depth, around, options.edge);
  const CellMeans means = cell_means(depth, edges, camera.depth_scale);
  const cv::Mat& inverse_depth = means.inverse_depth;
  const std::vector<Plane> planes = cell_planes(means, camera);
  const Smoother smoothed{static_cast<float>(depth_sigma),
                          static_cast<float>(std::max(options.detail * options.detail, 1e-12))};

  RangeImage range{cv::Mat(depth.size(), CV_32FC1), cv::Mat(depth.size(), CV_32FC1),
                   cv::Mat(depth.size(), CV_32FC1)};
  const auto columns = static_cast<std::size_t>(depth.cols);
  const auto unit = static_cast<float>(1.0 / camera.depth_scale);
  const auto max_depth = static_cast<float>(options.max_depth);
  const auto like = static_cast<float>(options.edge * kCell);
  std::vector<float> x2(columns), metres(columns), plane(columns);
  for (std::size_t u = 0; u < columns; ++u) {
    x2[u] = static_cast<float>(std::pow((static_cast<double>(u) - camera.cx) / camera.fx, 2));
  }
  for (int v = 0; v < depth.rows; ++v) {
    const auto* raw = depth.ptr<std::uint16_t>(v);
    const auto* nearest = around.reach.ptr<std::uint16_t>(v);
    auto* reach = range.reach.ptr<float>(v);
    for (std::size_t u = 0; u < columns; ++u) {
      metres[u] = unit * static_cast<float>(raw[u]);
      const float around_it = unit * static_cast<float>(nearest[u]);
      const float capped = around_it < max_depth ? around_it : max_depth;
      reach[u] = metres[u] > 0.0F ? capped : 0.0F;
    }
    const Plane* of_cell = planes.data() + static_cast<std::ptrdiff_t>(v / kCell) * inverse_depth.cols;
    const auto* edge = edges.ptr<std::uint8_t>(v);
    for (std::size_t u = 0; u < columns; ++u) {
      const Plane& cell = of_cell[u / kCell];
      plane[u] = cell.distance;
      if (edge[u] != 0 || raw[u] == 0) continue;
      metres[u] = smoothed(metres[u], cell, static_cast<float>(u), static_cast<float>(v));
      if (plane[u] > 0.0F) continue;
      plane[u] =
          plane_nearby(planes, inverse_depth, v / kCell, static_cast<int>(u) / kCell, 1.0F / metres[u], like);
    }
    const RowFilter filter{x2, static_cast<float>(1.0 + std::pow((v - camera.cy) / camera.fy, 2)), max_depth,
                           static_cast<float>(options.min_incidence * options.min_incidence)};
    filter(metres.data(), plane.data(), edge, range.depth.ptr<float>(v), range.incidence.ptr<float>(v));
  }
  if (!left_out.empty()) {
    range.depth.setTo(0.0F, left_out);
    range.incidence.setTo(0.0F, left_out);
  }
  return range;
}

}  // namespace ipl_slam
