#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

#include "common/random.hpp"

/// Procedural pictures for surfaces, all CV_8UC3 (BGR) with sides that are powers of two. Those for repeating
/// materials tile without a seam.
namespace ipl_slam::synthetic {

/// Smooth noise in [-1, 1] that tiles, CV_32FC1: octaves of value noise from `cells` cells across to ever
/// finer ones, each `gain` times as strong as the one before.
[[nodiscard]] cv::Mat tiling_noise(int width, int height, int cells, int octaves, float gain, Random& random);

/// A plain colour with mottling of the given strength (grey values): paint, cloth, skin.
[[nodiscard]] cv::Mat paint_plain(int size, const cv::Scalar& color, float strength, Random& random);
/// Bricks with mortar.
[[nodiscard]] cv::Mat paint_bricks(int size, Random& random);
/// Printed wall paper: specks and shapes of many sizes scattered without a pattern.
[[nodiscard]] cv::Mat paint_wallpaper(int size, Random& random);
/// Floor boards with grain.
[[nodiscard]] cv::Mat paint_planks(int size, Random& random);
/// Wooden surface with grain along x.
[[nodiscard]] cv::Mat paint_wood(int size, const cv::Scalar& color, Random& random);
/// Ceiling tiles with perforation.
[[nodiscard]] cv::Mat paint_ceiling(int size, Random& random);
/// Woven rug with a border and a pattern of lozenges.
[[nodiscard]] cv::Mat paint_rug(int width, int height, Random& random);
/// Checker board of uneven tiles, some of them patterned.
[[nodiscard]] cv::Mat paint_mosaic(int size, int cells, Random& random);
/// Rows of books standing on shelves, seen from the front.
[[nodiscard]] cv::Mat paint_books(int width, int height, int shelves, Random& random);
/// Framed poster: shapes, a headline and text.
[[nodiscard]] cv::Mat paint_poster(int width, int height, Random& random);
/// Printed sheet: headline, paragraphs, a diagram.
[[nodiscard]] cv::Mat paint_sheet(int width, int height, Random& random);
/// Computer screen with windows and text.
[[nodiscard]] cv::Mat paint_screen(int width, int height, Random& random);
/// Drawer fronts with handles and labels.
[[nodiscard]] cv::Mat paint_drawers(int width, int height, int rows, Random& random);
/// Cardboard box with tape, print and a label.
[[nodiscard]] cv::Mat paint_cardboard(int size, Random& random);

}  // namespace ipl_slam::synthetic
