// SPDX-License-Identifier: BSD-3-Clause
//
// How well features of an image are found again in a changed image, where the truth is known.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/features/brute_force.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/stages.hpp>

namespace orbis::test {

/// A projective map of pixels, row after row.
struct homography {
  std::array<double, 9> h{1, 0, 0, 0, 1, 0, 0, 0, 1};

  [[nodiscard]] std::array<double, 2> operator()(double x, double y) const {
    const double w = h[6] * x + h[7] * y + h[8];
    return {(h[0] * x + h[1] * y + h[2]) / w, (h[3] * x + h[4] * y + h[5]) / w};
  }
  [[nodiscard]] homography inverse() const {
    const auto minor = [&](std::size_t a, std::size_t b, std::size_t c, std::size_t d) {
      return h[a] * h[d] - h[b] * h[c];
    };
    return {{minor(4, 5, 7, 8), -minor(1, 2, 7, 8), minor(1, 2, 4, 5), -minor(3, 5, 6, 8), minor(0, 2, 6, 8),
             -minor(0, 2, 3, 5), minor(3, 4, 6, 7), -minor(0, 1, 6, 7), minor(0, 1, 3, 4)}};
  }
  /// By how much lengths grow at a pixel.
  [[nodiscard]] double scale_at(double x, double y) const {
    const auto p = (*this)(x, y), px = (*this)(x + 1, y), py = (*this)(x, y + 1);
    return std::sqrt(std::abs((px[0] - p[0]) * (py[1] - p[1]) - (px[1] - p[1]) * (py[0] - p[0])));
  }
  /// A turn by `angle` and growth by `scale` about a pixel.
  [[nodiscard]] static homography similarity(double angle, double scale, double cx, double cy) {
    const double c = scale * std::cos(angle), s = scale * std::sin(angle);
    return {{c, -s, cx - c * cx + s * cy, s, c, cy - s * cx - c * cy, 0, 0, 1}};
  }
};

/// An image seen through a homography; each pixel the mean of nine bilinear samples. 0 outside.
inline image<std::uint8_t> warped(const image<std::uint8_t>& from, const homography& map) {
  const homography back = map.inverse();
  image<std::uint8_t> to(from.width(), from.height());
  const auto sample = [&](double u, double v) {
    const int x = static_cast<int>(std::floor(u)), y = static_cast<int>(std::floor(v));
    if (!from.view().contains(x, y) || !from.view().contains(x + 1, y + 1)) return 0.0;
    const double a = u - x, b = v - y;
    return (1 - b) * ((1 - a) * from(x, y) + a * from(x + 1, y)) +
           b * ((1 - a) * from(x, y + 1) + a * from(x + 1, y + 1));
  };
  for (int y = 0; y != to.height(); ++y)
    for (int x = 0; x != to.width(); ++x) {
      double sum = 0.0;
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) {
          const auto p = back(x + i / 3.0, y + j / 3.0);
          sum += sample(p[0], p[1]);
        }
      to(x, y) = static_cast<std::uint8_t>(std::lround(sum / 9.0));
    }
  return to;
}

/// The same scene in another picture of it.
struct changed_image {
  std::string what;
  homography map;
  image<std::uint8_t> pixels;
};

/// Turns, scales, a change of perspective, blur, noise, and less light.
inline std::vector<changed_image> changes_of(const image<std::uint8_t>& im) {
  const double cx = im.width() / 2.0, cy = im.height() / 2.0;
  std::vector<changed_image> all;
  const auto seen_through = [&](const char* what, const homography& map) {
    all.push_back({what, map, warped(im, map)});
  };
  seen_through("turn 15", homography::similarity(0.26, 1.0, cx, cy));
  seen_through("turn 45", homography::similarity(0.79, 1.0, cx, cy));
  seen_through("turn 140", homography::similarity(2.44, 1.0, cx, cy));
  seen_through("scale 0.8", homography::similarity(0.0, 0.8, cx, cy));
  seen_through("scale 0.6", homography::similarity(0.1, 0.6, cx, cy));
  seen_through("scale 1.3", homography::similarity(0.1, 1.3, cx, cy));
  seen_through("perspective", {{1.05, 0.1, -30, -0.05, 1.1, 10, 1.5e-4, 2e-4, 1}});
  seen_through("shift", {{1, 0, 5.5, 0, 1, 3.25, 0, 0, 1}});

  const auto altered = [&](const char* what, auto value) {
    image<std::uint8_t> to(im.width(), im.height());
    for (int y = 0; y != im.height(); ++y)
      for (int x = 0; x != im.width(); ++x)
        to(x, y) = static_cast<std::uint8_t>(std::clamp(std::lround(value(x, y)), 0L, 255L));
    all.push_back({what, {}, std::move(to)});
  };
  const auto at = [&](int x, int y) {
    return static_cast<double>(im(std::clamp(x, 0, im.width() - 1), std::clamp(y, 0, im.height() - 1)));
  };
  altered("blur", [&](int x, int y) {
    double sum = 0.0, weights = 0.0;
    for (int j = -4; j <= 4; ++j)
      for (int i = -4; i <= 4; ++i) {
        const double weight = std::exp(-(i * i + j * j) / (2 * 1.5 * 1.5));
        sum += weight * at(x + i, y + j);
        weights += weight;
      }
    return sum / weights;
  });
  random_bits random{1};
  altered("noise", [&](int x, int y) {  // four uniform ones make nearly a Gaussian, of sigma 8
    double sum = 0.0;
    for (int i = 0; i != 4; ++i) sum += random.uniform(-1.0, 1.0);
    return at(x, y) + 8.0 * sum * std::sqrt(3.0) / 2.0;
  });
  altered("half the light", [&](int x, int y) { return 0.5 * at(x, y) + 5.0; });
  return all;
}

struct found_again {
  double repeatability = 0.0;   ///< features that lie where a feature of the other image lies, of those that could
  double matching_score = 0.0;  ///< features whose mutual nearest neighbour is the right one, of those that could
};

/// Features are the same if they are less than two pixels (of their level) apart and their sizes agree to
/// a level; each has one partner at most.
inline found_again compared(const features::features& f, const features::features& g, const homography& map, int width,
                            int height) {
  using features::keypoint;
  const homography back = map.inverse();
  const auto inside = [&](double x, double y) { return x >= 32 && y >= 32 && x < width - 32 && y < height - 32; };
  struct expected {
    double x, y, size;
  };
  std::vector<expected> wanted;
  std::vector<keypoint> there;
  std::vector<features::binary_descriptor<256>> a, b;
  for (std::size_t i = 0; i != f.size(); ++i) {
    const double x = static_cast<double>(f.keypoints[i].x), y = static_cast<double>(f.keypoints[i].y);
    const auto p = map(x, y);
    if (!inside(x, y) || !inside(p[0], p[1])) continue;
    wanted.push_back({p[0], p[1], static_cast<double>(f.keypoints[i].size) * map.scale_at(x, y)});
    a.push_back(f.descriptors[i]);
  }
  for (std::size_t i = 0; i != g.size(); ++i) {
    const double x = static_cast<double>(g.keypoints[i].x), y = static_cast<double>(g.keypoints[i].y);
    const auto p = back(x, y);
    if (!inside(x, y) || !inside(p[0], p[1])) continue;
    there.push_back(g.keypoints[i]);
    b.push_back(g.descriptors[i]);
  }
  const auto possible = static_cast<double>(std::min(wanted.size(), there.size()));
  if (possible == 0.0) return {};
  const auto distance = [&](std::size_t i, std::size_t j) {
    return std::hypot(static_cast<double>(there[j].x) - wanted[i].x, static_cast<double>(there[j].y) - wanted[i].y) /
           (static_cast<double>(there[j].size) / 31.0);
  };
  std::vector<std::tuple<double, std::size_t, std::size_t>> pairs;
  for (std::size_t i = 0; i != wanted.size(); ++i)
    for (std::size_t j = 0; j != there.size(); ++j)
      if (std::abs(std::log(wanted[i].size / static_cast<double>(there[j].size))) < 0.2 && distance(i, j) < 2.0)
        pairs.emplace_back(distance(i, j), i, j);
  std::sort(pairs.begin(), pairs.end());
  std::vector<bool> used_a(wanted.size()), used_b(there.size());
  double repeated = 0.0, matched = 0.0;
  for (const auto& [d, i, j] : pairs)
    if (!used_a[i] && !used_b[j]) {
      used_a[i] = used_b[j] = true;
      ++repeated;
    }
  constexpr auto matcher = features::brute_force(features::hamming{}) | features::cross_check{};
  for (const features::match& m : matcher(a, b)) matched += distance(m.query, m.train) < 3.0 ? 1.0 : 0.0;
  return {repeated / possible, matched / possible};
}

/// Of the 32-pixel cells, the share that holds a keypoint.
inline double coverage(const features::features& f, int width, int height) {
  std::set<std::pair<int, int>> cells;
  for (const features::keypoint& k : f.keypoints)
    cells.emplace(static_cast<int>(k.x + 0.5F) / 32, static_cast<int>(k.y + 0.5F) / 32);
  return static_cast<double>(cells.size()) / ((width / 32) * (height / 32));
}

}  // namespace orbis::test
