// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// ORB features that are spread evenly over the image.
///
/// Source: Rublee, Rabaud, Konolige, Bradski, "ORB: an efficient alternative to SIFT or SURF", ICCV
/// 2011. They take the strongest corners, which cluster; this one covers the image first.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/detail/extract/cover_first.hpp>
#include <orbis/features/detail/extract/fast.hpp>
#include <orbis/features/detail/extract/kept_memory.hpp>
#include <orbis/features/detail/extract/orientation.hpp>
#include <orbis/features/detail/extract/steered_brief.hpp>
#include <orbis/features/extractor.hpp>
#include <orbis/features/grey.hpp>
#include <orbis/features/pyramid.hpp>

namespace orbis::features {

/// The parts of `orb_extractor` and those that can stand in for them; see `extractor.hpp` for the concepts.
/// - `fast9` finds FAST-9/16 corners;
/// - `cover_first` chooses corners that cover the image, then the strongest; `strongest` the strongest of each level;
/// - `intensity_centroid` turns keypoints towards the centre of brightness; `upright` does not turn them;
/// - `steered_brief` describes keypoints by ORB's pattern, turned to their direction.
using detail::fast9, detail::cover_first, detail::strongest, detail::intensity_centroid, detail::upright,
    detail::steered_brief;

/// Options of an ORB extractor.
struct orb_options {
  int max_features = 1000;    ///< at most so many
  int levels = 8;             ///< of the image pyramid; levels that are too small for a patch are left out
  float scale_factor = 1.2F;  ///< between two levels, > 1
  int threshold = 14;         ///< brightness step of a corner (of the slightly smoothed image)
  int min_threshold = 3;      ///< where no corner reaches `threshold`; equal to it: no weaker corners at all
};

/// Finds keypoints on the levels of an image pyramid and describes them. The parts that find corners, choose among
/// them, give them a direction and describe them are types. Calls on a const object may run at the same time. The
/// extractor keeps its working memory for the next call, one piece for each call that ran at the same time.
template <corner_detector Detector = fast9, corner_selection Distribution = cover_first,
          orientation_estimator Orientation = intensity_centroid, patch_descriptor Descriptor = steered_brief>
class basic_orb_extractor {
 public:
  using descriptor = typename Descriptor::descriptor;
  using features_type = basic_features<descriptor>;

  /// The least distance of a keypoint from the edge, pixels of its level.
  static constexpr int border = std::max<int>(Orientation::radius, Descriptor::reach) + 1;

  basic_orb_extractor() = default;
  /// @pre max_features >= 0, levels >= 1, scale_factor > 1, 1 <= min_threshold <= threshold <= 254
  explicit basic_orb_extractor(const orb_options& options, Detector detect = {}, Distribution choose = {},
                               Orientation orient = {}, Descriptor describe = {})
      : options_{options},
        detect_{std::move(detect)},
        choose_{std::move(choose)},
        orient_{std::move(orient)},
        describe_{std::move(describe)} {
    assert(options.max_features >= 0 && options.levels >= 1 && options.scale_factor > 1.0F);
    assert(options.min_threshold >= 1 && options.min_threshold <= options.threshold && options.threshold <= 254);
  }

  [[nodiscard]] const orb_options& options() const noexcept { return options_; }

  /// The features of a grey image, ordered by level, then from top to bottom. `mask`: empty, or of the image's
  /// size, 0 where no keypoint may lie. `regions`: empty, or the only places where keypoints may lie; they may
  /// overlap and reach beyond the image. An image with a side of less than 2 `border` + 1 pixels
  /// (39 by default) has no features. O(pixels + features).
  [[nodiscard]] features_type operator()(image_view<const std::uint8_t> image, image_view<const std::uint8_t> mask = {},
                                         std::span<const region> regions = {}) const {
    features_type found;
    into(found, image, mask, regions);
    return found;
  }

  /// The features of the luma of a colour image (`luma`); the rest as for a grey image.
  [[nodiscard]] features_type operator()(image_view<const rgb8> image, image_view<const std::uint8_t> mask = {},
                                         std::span<const region> regions = {}) const {
    features_type found;
    into(found, image, mask, regions);
    return found;
  }

  /// Deleted: make 8 bits of a 16-bit image by `narrow` first, which needs its range of values.
  features_type operator()(image_view<const std::uint16_t> image, image_view<const std::uint8_t> mask = {},
                           std::span<const region> regions = {}) const = delete;

  /// Replaces the contents of `found` by the features of an image. Allocates nothing once an image of this size with as
  /// many corners has been seen.
  void into(features_type& found, image_view<const std::uint8_t> image, image_view<const std::uint8_t> mask = {},
            std::span<const region> regions = {}) const {
    auto memory = kept_.take();
    extract(found, *memory, memory->pyramid, image, mask, regions);
    kept_.give(std::move(memory));
  }
  /// As above, with the image's pyramid left in `pyramid` for others to use: a keypoint's octave is its level there.
  void into(features_type& found, image_pyramid& pyramid, image_view<const std::uint8_t> image,
            image_view<const std::uint8_t> mask = {}, std::span<const region> regions = {}) const {
    auto memory = kept_.take();
    extract(found, *memory, pyramid, image, mask, regions);
    kept_.give(std::move(memory));
  }
  void into(features_type& found, image_view<const rgb8> image, image_view<const std::uint8_t> mask = {},
            std::span<const region> regions = {}) const {
    auto memory = kept_.take();
    const auto pixels = static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height());
    if (memory->grey.size() < pixels) memory->grey.resize(pixels);
    const image_view<std::uint8_t> grey{memory->grey.data(), image.width(), image.height()};
    luma(image, grey);
    extract(found, *memory, memory->pyramid, grey, mask, regions);
    kept_.give(std::move(memory));
  }

 private:
  struct workspace {
    std::vector<std::uint8_t> grey;
    image_pyramid pyramid;
    std::vector<level_corners> levels;
    typename Detector::workspace detector;
    typename Distribution::workspace distribution;
    typename Descriptor::workspace descriptor;
  };

  void extract(features_type& found, workspace& memory, image_pyramid& pyramid, image_view<const std::uint8_t> image,
               image_view<const std::uint8_t> mask, std::span<const region> regions) const {
    assert(mask.empty() || (mask.width() == image.width() && mask.height() == image.height()));
    found.keypoints.clear();
    found.descriptors.clear();
    pyramid.build(image, options_.levels, static_cast<double>(options_.scale_factor), 2 * border + 1);
    const std::size_t levels = pyramid.size();
    if (levels == 0 || options_.max_features == 0) return;
    if (memory.levels.size() < levels) memory.levels.resize(levels);
    for (std::size_t level = 0; level != levels; ++level) {
      const image_view<const std::uint8_t> pixels = pyramid[level];
      level_corners& on = memory.levels[level];
      on.area = area_of(pixels, image, regions);
      on.scale = static_cast<double>(image.width()) / pixels.width();
      detect_(pixels, on.area, {options_.threshold, options_.min_threshold}, memory.detector, on.corners);
      drop_unwanted(on.corners, pixels, image, mask, regions);
    }
    choose_(std::span{memory.levels}.first(levels), options_.max_features, memory.distribution);
    for (std::size_t level = 0; level != levels; ++level)
      describe(found, memory, pyramid[level], static_cast<int>(level), image);
  }

  /// The part of a level in which keypoints can lie: what surrounds all regions, without the border.
  [[nodiscard]] static region area_of(image_view<const std::uint8_t> level, image_view<const std::uint8_t> image,
                                      std::span<const region> regions) {
    const auto extent = [](int level_size, int full_size, std::span<const region> all, int region::*from,
                           int region::*size) {
      double first = 0.0, last = full_size - 1.0;
      if (!all.empty()) {
        first = full_size;
        last = -1.0;
        for (const region& r : all) {
          first = std::min<double>(first, r.*from);
          last = std::max(last, static_cast<double>(r.*from) + r.*size - 1.0);
        }
      }
      const auto to_level = [&](double at) { return image_pyramid::full_coordinate(at, full_size, level_size); };
      // Half a pixel more on both sides, because the position of a keypoint is rounded to a pixel.
      const double begin = std::clamp(std::floor(to_level(first - 0.5)), static_cast<double>(border), 1e9);
      const double end =
          std::clamp(std::ceil(to_level(last + 0.5)) + 1.0, 0.0, static_cast<double>(level_size - border));
      return std::pair(static_cast<int>(begin), std::max(0, static_cast<int>(end - begin)));
    };
    const auto [x, width] = extent(level.width(), image.width(), regions, &region::x, &region::width);
    const auto [y, height] = extent(level.height(), image.height(), regions, &region::y, &region::height);
    return {x, y, width, height};
  }

  static void drop_unwanted(std::vector<corner>& corners, image_view<const std::uint8_t> level,
                            image_view<const std::uint8_t> image, image_view<const std::uint8_t> mask,
                            std::span<const region> regions) {
    if (mask.empty() && regions.empty()) return;
    const auto pixel = [](int at, float within, int level_size, int full_size) {
      return std::clamp(static_cast<int>(std::lround(
                            image_pyramid::full_coordinate(at + static_cast<double>(within), level_size, full_size))),
                        0, full_size - 1);
    };
    std::erase_if(corners, [&](const corner& c) {
      const int x = pixel(c.x, c.dx, level.width(), image.width());
      const int y = pixel(c.y, c.dy, level.height(), image.height());
      if (!mask.empty() && mask(x, y) == 0) return true;
      return !regions.empty() &&
             std::none_of(regions.begin(), regions.end(), [&](const region& r) { return r.contains(x, y); });
    });
  }

  /// Appends the chosen corners of a level with orientation and descriptor.
  void describe(features_type& found, workspace& memory, image_view<const std::uint8_t> level, int octave,
                image_view<const std::uint8_t> image) const {
    const std::vector<corner>& corners = memory.levels[static_cast<std::size_t>(octave)].corners;
    if (corners.empty()) return;
    describe_.prepare(level, corners.front().y, corners.back().y + 1, memory.descriptor);
    const float size = static_cast<float>(Descriptor::diameter) * static_cast<float>(image.width()) /
                       static_cast<float>(level.width());
    for (const corner& c : corners) {
      const orientation o = orient_(level, c.x, c.y);
      found.descriptors.push_back(describe_(memory.descriptor, c.x, c.y, o));
      found.keypoints.push_back({.x = static_cast<float>(image_pyramid::full_coordinate(c.x + static_cast<double>(c.dx),
                                                                                        level.width(), image.width())),
                                 .y = static_cast<float>(image_pyramid::full_coordinate(
                                     c.y + static_cast<double>(c.dy), level.height(), image.height())),
                                 .size = size,
                                 .angle = o.angle,
                                 .response = c.response,
                                 .octave = octave});
    }
  }

  orb_options options_{};
  [[no_unique_address]] Detector detect_{};
  [[no_unique_address]] Distribution choose_{};
  [[no_unique_address]] Orientation orient_{};
  [[no_unique_address]] Descriptor describe_{};
  mutable detail::kept_memory<workspace> kept_;
};

/// ORB features with the default parts.
using orb_extractor = basic_orb_extractor<>;

}  // namespace orbis::features
