#include "dataset/synthetic/paint.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace ipl_slam::synthetic {
namespace {

using cv::Point;
using cv::Rect;
using cv::Scalar;

Scalar random_color(Random& random, double low = 30, double high = 230) {
  return {random.uniform(low, high), random.uniform(low, high), random.uniform(low, high)};
}

Scalar shaded(const Scalar& color, double factor) {
  return color * factor;
}

cv::Mat blank(int width, int height, const Scalar& color) {
  return {height, width, CV_8UC3, color};
}

// Adds noise x strength to all channels.
void mottle(cv::Mat& image, const cv::Mat& noise, float strength) {
  for (int y = 0; y < image.rows; ++y) {
    auto* row = image.ptr<cv::Vec3b>(y);
    const auto* n = noise.ptr<float>(y % noise.rows);
    for (int x = 0; x < image.cols; ++x) {
      const float add = strength * n[x % noise.cols];
      for (int c = 0; c < 3; ++c) row[x][c] = cv::saturate_cast<std::uint8_t>(row[x][c] + add);
    }
  }
}

void fill(cv::Mat& image, const Rect& area, const Scalar& color) {
  cv::rectangle(image, area, color, cv::FILLED);
}

// A made-up word of upper-case letters and digits.
std::string word(Random& random, int length) {
  std::string text;
  for (int i = 0; i < length; ++i) text += "ABCDEFGHJKLMNPRSTUVXYZ0123456789"[random.index(32)];
  return text;
}

// A line of made-up words, about `width` pixels long; letters `height` pixels high.
void write_line(cv::Mat& image, Point origin, int width, double height, const Scalar& color, Random& random) {
  const double scale = height / 21.0;  // letters of this font are 21 pixels high at scale 1
  const int thickness = std::max(1, static_cast<int>(std::lround(height / 9.0)));
  const int letter = std::max(1, static_cast<int>(19.0 * scale));
  int left = width / letter;
  std::string text;
  while (left > 2) {
    const int length = std::min(left, random.uniform_int(2, 8));
    text += word(random, length) + " ";
    left -= length + 1;
  }
  cv::putText(image, text, origin, cv::FONT_HERSHEY_SIMPLEX, scale, color, thickness, cv::LINE_AA);
}

void write_paragraph(cv::Mat& image, const Rect& area, double height, const Scalar& color, Random& random) {
  const int pitch = static_cast<int>(height * 1.8);
  for (int y = area.y + pitch; y <= area.y + area.height; y += pitch) {
    const int width = random.chance(0.15) ? area.width / 2 : area.width;
    write_line(image, {area.x, y}, width, height, color, random);
  }
}

void draw_diagram(cv::Mat& image, const Rect& area, Random& random) {
  cv::rectangle(image, area, Scalar::all(40), 2);
  const int bars = random.uniform_int(4, 7);
  for (int i = 0; i < bars; ++i) {
    const int width = area.width / (bars + 1);
    const int height = static_cast<int>(area.height * random.uniform(0.2, 0.9));
    fill(image, {area.x + width / 2 + i * width, area.y + area.height - height, width * 2 / 3, height},
         random_color(random));
  }
}

void draw_shape(cv::Mat& image, const Rect& area, Random& random) {
  const Point centre(area.x + random.uniform_int(0, area.width), area.y + random.uniform_int(0, area.height));
  const int size = random.uniform_int(area.width / 16, area.width / 4);
  const Scalar color = random_color(random, 10, 250);
  const cv::Mat inside = image(area);
  cv::Mat canvas = inside;
  const Point at = centre - area.tl();
  switch (random.index(4)) {
    case 0:
      cv::circle(canvas, at, size, color, cv::FILLED, cv::LINE_AA);
      break;
    case 1:
      fill(canvas, {at.x - size, at.y - size / 2, 2 * size, size}, color);
      break;
    case 2: {
      const double turn = random.uniform(0.0, 6.28);
      std::vector<Point> corners;
      for (int i = 0; i < 3; ++i) {
        corners.emplace_back(at.x + static_cast<int>(size * std::cos(turn + 2.1 * i)),
                             at.y + static_cast<int>(size * std::sin(turn + 2.1 * i)));
      }
      cv::fillConvexPoly(canvas, corners, color, cv::LINE_AA);
      break;
    }
    default:
      cv::line(canvas, at, at + Point(size, random.uniform_int(-size, size)), color, 6, cv::LINE_AA);
  }
}

}  // namespace

cv::Mat tiling_noise(int width, int height, int cells, int octaves, float gain, Random& random) {
  cv::Mat sum = cv::Mat::zeros(height, width, CV_32FC1);
  float amplitude = 1.0F;
  float total = 0.0F;
  for (int octave = 0; octave < octaves && cells <= width; ++octave, cells *= 2, amplitude *= gain) {
    const int rows = std::max(1, cells * height / width);
    std::vector<float> grid(static_cast<std::size_t>(cells) * rows);
    for (float& value : grid) value = static_cast<float>(random.uniform(-1.0, 1.0));
    std::vector<int> left(width), right(width);
    std::vector<float> weight(width);
    for (int x = 0; x < width; ++x) {
      const float position = static_cast<float>(x) * static_cast<float>(cells) / static_cast<float>(width);
      left[x] = static_cast<int>(position) % cells;
      right[x] = (left[x] + 1) % cells;
      const float f = position - std::floor(position);
      weight[x] = f * f * (3.0F - 2.0F * f);
    }
    for (int y = 0; y < height; ++y) {
      const float position = static_cast<float>(y) * static_cast<float>(rows) / static_cast<float>(height);
      const int top = static_cast<int>(position) % rows;
      const float f = position - std::floor(position);
      const float wy = f * f * (3.0F - 2.0F * f);
      const float* a = grid.data() + static_cast<std::size_t>(top) * cells;
      const float* b = grid.data() + static_cast<std::size_t>((top + 1) % rows) * cells;
      auto* row = sum.ptr<float>(y);
      for (int x = 0; x < width; ++x) {
        const float upper = a[left[x]] + (a[right[x]] - a[left[x]]) * weight[x];
        const float lower = b[left[x]] + (b[right[x]] - b[left[x]]) * weight[x];
        row[x] += amplitude * (upper + (lower - upper) * wy);
      }
    }
    total += amplitude;
  }
  sum *= 1.0F / total;
  return sum;
}

cv::Mat paint_plain(int size, const Scalar& color, float strength, Random& random) {
  cv::Mat image = blank(size, size, color);
  mottle(image, tiling_noise(size, size, 8, 6, 0.75F, random), strength);
  return image;
}

cv::Mat paint_bricks(int size, Random& random) {
  cv::Mat image = blank(size, size, {150, 155, 160});
  constexpr int kRows = 16;
  constexpr int kColumns = 8;
  const int height = size / kRows;
  const int width = size / kColumns;
  for (int r = 0; r < kRows; ++r) {
    for (int c = 0; c < kColumns; ++c) {
      const double tone = random.uniform(0.65, 1.15);
      const Scalar color = shaded({70, 85, 150}, tone);
      const int x = c * width + (r % 2) * width / 2;
      const Rect brick(x + 2, r * height + 2, width - 4, height - 4);
      fill(image, brick, color);
      fill(image, {brick.x - size, brick.y, brick.width, brick.height}, color);  // the half that wraps around
    }
  }
  mottle(image, tiling_noise(size, size, 32, 4, 0.8F, random), 45.0F);
  return image;
}

cv::Mat paint_wallpaper(int size, Random& random) {
  cv::Mat image = paint_plain(size, {205, 215, 215}, 18.0F, random);
  const int margin = size / 16;  // what is cut at an edge would not meet its other half
  for (int i = 0; i < 260; ++i) {
    const Point at(random.uniform_int(margin, size - margin), random.uniform_int(margin, size - margin));
    const int side = random.uniform_int(size / 64, size / 16);
    draw_shape(image, {at.x - side, at.y - side, 2 * side, 2 * side}, random);
  }
  return image;
}

cv::Mat paint_wood(int size, const Scalar& color, Random& random) {
  cv::Mat image = blank(size, size, color);
  const cv::Mat warp = tiling_noise(size, size, 4, 3, 0.5F, random);
  const cv::Mat fibre = tiling_noise(size, size, 64, 3, 0.7F, random);
  cv::Mat grain(size, size, CV_32FC1);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const float rings = std::sin(6.2831853F * (12.0F * static_cast<float>(y) / static_cast<float>(size) +
                                                 1.6F * warp.at<float>(y, x)));
      grain.at<float>(y, x) = 0.6F * rings + 0.9F * fibre.at<float>(y, x / 8);
    }
  }
  mottle(image, grain, 20.0F);
  return image;
}

cv::Mat paint_planks(int size, Random& random) {
  cv::Mat image = paint_wood(size, {95, 130, 165}, random);
  constexpr int kRows = 8;
  const int height = size / kRows;
  for (int r = 0; r < kRows; ++r) {
    const int joint = random.uniform_int(0, size - 1);
    const double tones[2] = {random.uniform(0.7, 1.1), random.uniform(0.7, 1.1)};
    for (int half = 0; half < 2; ++half) {
      for (int x = 0; x < size / 2; ++x) {
        const int column = (joint + half * size / 2 + x) % size;
        cv::Mat strip = image(Rect(column, r * height, 1, height));
        strip *= tones[half];
      }
      fill(image, {(joint + half * size / 2) % size, r * height, 2, height}, {25, 35, 45});
    }
    fill(image, {0, r * height, size, 2}, {30, 40, 55});
  }
  return image;
}

cv::Mat paint_ceiling(int size, Random& random) {
  cv::Mat image = blank(size, size, {215, 220, 222});
  mottle(image, tiling_noise(size, size, 16, 4, 0.8F, random), 10.0F);
  const int tile = size / 4;
  for (int k = 0; k < 4; ++k) {
    fill(image, {k * tile, 0, 3, size}, Scalar::all(150));
    fill(image, {0, k * tile, size, 3}, Scalar::all(150));
  }
  for (int k = 0; k < 500; ++k) {
    const Point at(random.uniform_int(4, size - 5), random.uniform_int(4, size - 5));
    cv::circle(image, at, random.uniform_int(1, 3), Scalar::all(random.uniform(110, 170)), cv::FILLED,
               cv::LINE_AA);
  }
  return image;
}

cv::Mat paint_rug(int width, int height, Random& random) {
  const Scalar base = random_color(random, 40, 120);
  cv::Mat image = blank(width, height, base);
  const int cell = width / 12;
  for (int y = 0; y * cell < height; ++y) {
    for (int x = 0; x < 12; ++x) {
      const Point at(x * cell + cell / 2, y * cell + cell / 2);
      const int r = cell * random.uniform_int(20, 48) / 100;
      const Point diamond[4] = {at + Point(r, 0), at + Point(0, r), at - Point(r, 0), at - Point(0, r)};
      cv::fillConvexPoly(image, diamond, 4, random_color(random, 30, 220), cv::LINE_AA);
      cv::circle(image, at, r / 3, random_color(random, 20, 240), cv::FILLED, cv::LINE_AA);
    }
  }
  cv::rectangle(image, Rect(0, 0, width, height), shaded(base, 0.5), cell / 2);
  mottle(image, tiling_noise(width, height, 128, 2, 0.9F, random), 18.0F);
  return image;
}

cv::Mat paint_mosaic(int size, int cells, Random& random) {
  cv::Mat image = blank(size, size, Scalar::all(190));
  const int cell = size / cells;
  for (int y = 0; y < cells; ++y) {
    for (int x = 0; x < cells; ++x) {
      const double grey = (x + y) % 2 ? random.uniform(150, 240) : random.uniform(30, 110);
      const Scalar tint = random_color(random, -25, 25);
      const Rect area(x * cell + 1, y * cell + 1, cell - 2, cell - 2);
      fill(image, area, Scalar::all(grey) + tint);
      if (random.chance(0.35)) draw_shape(image, area, random);
    }
  }
  return image;
}

cv::Mat paint_books(int width, int height, int shelves, Random& random) {
  cv::Mat image = blank(width, height, {28, 34, 40});
  const int pitch = height / shelves;
  const int board = std::max(3, pitch / 12);
  for (int s = 0; s < shelves; ++s) {
    const int floor_y = (s + 1) * pitch - board;
    fill(image, {0, floor_y, width, board}, {90, 120, 150});
    for (int x = board; x < width - board;) {
      const int thick = std::min(random.uniform_int(width / 40, width / 16), width - board - x);
      const int tall = static_cast<int>((pitch - board) * random.uniform(0.62, 0.94));
      if (random.chance(0.9) && thick > 4) {
        const Scalar color = random_color(random, 20, 235);
        const Rect spine(x, floor_y - tall, thick - 1, tall);
        fill(image, spine, color);
        fill(image, {x, spine.y + tall / 8, thick - 1, std::max(2, tall / 25)}, random_color(random));
        fill(image,
             {x + thick / 4, spine.y + tall / 4, std::max(1, thick / 2),
              tall * random.uniform_int(20, 50) / 100},
             random_color(random, 10, 250));
        fill(image, {x, spine.y + tall * 9 / 10, thick - 1, std::max(2, tall / 30)}, shaded(color, 0.5));
      }
      x += thick;
    }
  }
  fill(image, {0, 0, board, height}, {90, 120, 150});
  fill(image, {width - board, 0, board, height}, {90, 120, 150});
  return image;
}

cv::Mat paint_poster(int width, int height, Random& random) {
  const Scalar base = random_color(random, 60, 245);
  cv::Mat image = blank(width, height, base);
  mottle(image, tiling_noise(width, height, 8, 5, 0.7F, random), 25.0F);
  const int edge = width / 24;
  const Rect picture(edge * 2, height / 5, width - 4 * edge, height / 2);
  fill(image, picture, random_color(random, 20, 240));
  for (int i = 0; i < 26; ++i) draw_shape(image, picture, random);
  write_line(image, {2 * edge, height / 6}, width - 3 * edge, height / 14.0, Scalar::all(20), random);
  write_paragraph(image, {2 * edge, height * 3 / 4, width - 4 * edge, height / 5}, height / 42.0,
                  Scalar::all(30), random);
  cv::rectangle(image, Rect(0, 0, width, height), Scalar::all(random.uniform(20, 70)), edge);
  return image;
}

cv::Mat paint_sheet(int width, int height, Random& random) {
  cv::Mat image = blank(width, height, Scalar::all(235));
  const int edge = width / 12;
  write_line(image, {edge, height / 9}, width - 2 * edge, height / 20.0, Scalar::all(30), random);
  const int text_height = height / 3;
  write_paragraph(image, {edge, height / 7, width - 2 * edge, text_height}, height / 50.0, Scalar::all(45),
                  random);
  draw_diagram(image, {edge, height / 2, width - 2 * edge, height / 5}, random);
  write_paragraph(image, {edge, height * 3 / 4, width - 2 * edge, height / 5}, height / 50.0, Scalar::all(45),
                  random);
  return image;
}

cv::Mat paint_screen(int width, int height, Random& random) {
  cv::Mat image = blank(width, height, random_color(random, 50, 140));
  mottle(image, tiling_noise(width, height, 4, 5, 0.7F, random), 40.0F);
  for (int i = 0; i < 3; ++i) {
    const Rect window(random.uniform_int(width / 20, width / 2), random.uniform_int(height / 20, height / 2),
                      width * 2 / 5, height * 2 / 5);
    const bool dark = random.chance(0.4);
    fill(image, window, Scalar::all(dark ? 40 : 240));
    fill(image, {window.x, window.y, window.width, height / 24}, random_color(random, 80, 200));
    write_paragraph(image,
                    {window.x + 6, window.y + height / 24, window.width - 12, window.height - height / 12},
                    height / 50.0, Scalar::all(dark ? 220 : 30), random);
  }
  fill(image, {0, height - height / 18, width, height / 18}, Scalar::all(60));
  for (int i = 0; i < 8; ++i) {
    fill(image, {width / 40 + i * width / 18, height - height / 22, height / 26, height / 26},
         random_color(random));
  }
  cv::rectangle(image, Rect(0, 0, width, height), Scalar::all(18), width / 32);
  return image;
}

cv::Mat paint_drawers(int width, int height, int rows, Random& random) {
  const Scalar base = random_color(random, 120, 190);
  cv::Mat image = blank(width, height, base);
  mottle(image, tiling_noise(width, height, 16, 5, 0.8F, random), 14.0F);
  const int pitch = height / rows;
  for (int r = 0; r < rows; ++r) {
    const Rect front(width / 32, r * pitch + pitch / 16, width - width / 16, pitch - pitch / 8);
    cv::rectangle(image, front, shaded(base, 0.45), 3);
    fill(image, {width * 2 / 5, front.y + pitch / 6, width / 5, std::max(4, pitch / 14)}, Scalar::all(45));
    const Rect label(width / 8 + random.uniform_int(0, width / 2), front.y + pitch / 2, width / 5, pitch / 5);
    fill(image, label, Scalar::all(240));
    write_line(image, {label.x + 4, label.y + label.height * 3 / 4}, label.width, label.height / 2.5,
               Scalar::all(30), random);
  }
  return image;
}

cv::Mat paint_cardboard(int size, Random& random) {
  cv::Mat image = blank(size, size, shaded({105, 145, 185}, random.uniform(0.8, 1.1)));
  mottle(image, tiling_noise(size, size, 16, 5, 0.8F, random), 22.0F);
  fill(image, {size * 7 / 16, 0, size / 8, size}, {120, 175, 205});
  const Rect label(size / 10, size / 8, size / 3, size / 4);
  fill(image, label, Scalar::all(238));
  write_paragraph(image, {label.x + 4, label.y, label.width - 8, label.height - 6}, size / 26.0,
                  Scalar::all(25), random);
  for (int i = 0; i < 4; ++i) {
    draw_shape(image, {size / 2, size / 2, size * 7 / 16, size * 7 / 16}, random);
  }
  write_line(image, {size / 12, size * 3 / 4}, size / 3, size / 10.0, {40, 50, 120}, random);
  write_line(image, {size / 12, size * 9 / 10}, size * 2 / 5, size / 16.0, {30, 30, 30}, random);
  cv::rectangle(image, Rect(0, 0, size, size), {60, 90, 120}, 3);
  return image;
}

}  // namespace ipl_slam::synthetic
