// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of orb.hpp.
#pragma once

#include <cmath>

#include <orbis/features/detail/extract/cover_first.hpp>
#include <orbis/features/detail/extract/fast.hpp>
#include <orbis/features/detail/extract/orientation.hpp>
#include <orbis/features/detail/extract/steered_brief.hpp>
#include <orbis/features/grey.hpp>
#include <orbis/features/orb.hpp>

namespace orbis::features {

template <corner_detector Detector, corner_selection Distribution, orientation_estimator Orientation,
          patch_descriptor Descriptor>
typename basic_orb_extractor<Detector, Distribution, Orientation, Descriptor>::features_type
basic_orb_extractor<Detector, Distribution, Orientation, Descriptor>::operator()(
    image_view<const std::uint8_t> image, image_view<const std::uint8_t> mask, std::span<const region> regions) const {
  features_type found;
  into(found, image, mask, regions);
  return found;
}

template <corner_detector Detector, corner_selection Distribution, orientation_estimator Orientation,
          patch_descriptor Descriptor>
typename basic_orb_extractor<Detector, Distribution, Orientation, Descriptor>::features_type
basic_orb_extractor<Detector, Distribution, Orientation, Descriptor>::operator()(
    image_view<const rgb8> image, image_view<const std::uint8_t> mask, std::span<const region> regions) const {
  features_type found;
  into(found, image, mask, regions);
  return found;
}

template <corner_detector Detector, corner_selection Distribution, orientation_estimator Orientation,
          patch_descriptor Descriptor>
void basic_orb_extractor<Detector, Distribution, Orientation, Descriptor>::into(features_type& found,
                                                                                image_view<const std::uint8_t> image,
                                                                                image_view<const std::uint8_t> mask,
                                                                                std::span<const region> regions) const {
  auto memory = kept_.take();
  extract(found, *memory, memory->pyramid, image, mask, regions);
  kept_.give(std::move(memory));
}

template <corner_detector Detector, corner_selection Distribution, orientation_estimator Orientation,
          patch_descriptor Descriptor>
void basic_orb_extractor<Detector, Distribution, Orientation, Descriptor>::into(features_type& found,
                                                                                image_pyramid& pyramid,
                                                                                image_view<const std::uint8_t> image,
                                                                                image_view<const std::uint8_t> mask,
                                                                                std::span<const region> regions) const {
  auto memory = kept_.take();
  extract(found, *memory, pyramid, image, mask, regions);
  kept_.give(std::move(memory));
}

template <corner_detector Detector, corner_selection Distribution, orientation_estimator Orientation,
          patch_descriptor Descriptor>
void basic_orb_extractor<Detector, Distribution, Orientation, Descriptor>::into(features_type& found,
                                                                                image_view<const rgb8> image,
                                                                                image_view<const std::uint8_t> mask,
                                                                                std::span<const region> regions) const {
  auto memory = kept_.take();
  const auto pixels = static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height());
  if (memory->grey.size() < pixels) memory->grey.resize(pixels);
  const image_view<std::uint8_t> grey{memory->grey.data(), image.width(), image.height()};
  luma(image, grey);
  extract(found, *memory, memory->pyramid, grey, mask, regions);
  kept_.give(std::move(memory));
}

template <corner_detector Detector, corner_selection Distribution, orientation_estimator Orientation,
          patch_descriptor Descriptor>
void basic_orb_extractor<Detector, Distribution, Orientation, Descriptor>::extract(
    features_type& found, workspace& memory, image_pyramid& pyramid, image_view<const std::uint8_t> image,
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
template <corner_detector Detector, corner_selection Distribution, orientation_estimator Orientation,
          patch_descriptor Descriptor>
region basic_orb_extractor<Detector, Distribution, Orientation, Descriptor>::area_of(
    image_view<const std::uint8_t> level, image_view<const std::uint8_t> image, std::span<const region> regions) {
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
    const double end = std::clamp(std::ceil(to_level(last + 0.5)) + 1.0, 0.0, static_cast<double>(level_size - border));
    return std::pair(static_cast<int>(begin), std::max(0, static_cast<int>(end - begin)));
  };
  const auto [x, width] = extent(level.width(), image.width(), regions, &region::x, &region::width);
  const auto [y, height] = extent(level.height(), image.height(), regions, &region::y, &region::height);
  return {x, y, width, height};
}

template <corner_detector Detector, corner_selection Distribution, orientation_estimator Orientation,
          patch_descriptor Descriptor>
void basic_orb_extractor<Detector, Distribution, Orientation, Descriptor>::drop_unwanted(
    std::vector<corner>& corners, image_view<const std::uint8_t> level, image_view<const std::uint8_t> image,
    image_view<const std::uint8_t> mask, std::span<const region> regions) {
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
template <corner_detector Detector, corner_selection Distribution, orientation_estimator Orientation,
          patch_descriptor Descriptor>
void basic_orb_extractor<Detector, Distribution, Orientation, Descriptor>::describe(
    features_type& found, workspace& memory, image_view<const std::uint8_t> level, int octave,
    image_view<const std::uint8_t> image) const {
  const std::vector<corner>& corners = memory.levels[static_cast<std::size_t>(octave)].corners;
  if (corners.empty()) return;
  describe_.prepare(level, corners.front().y, corners.back().y + 1, memory.descriptor);
  const float size =
      static_cast<float>(Descriptor::diameter) * static_cast<float>(image.width()) / static_cast<float>(level.width());
  for (const corner& c : corners) {
    const orientation o = orient_(level, c.x, c.y);
    found.descriptors.push_back(describe_(memory.descriptor, c.x, c.y, o));
    found.keypoints.push_back({.x = static_cast<float>(image_pyramid::full_coordinate(c.x + static_cast<double>(c.dx),
                                                                                      level.width(), image.width())),
                               .y = static_cast<float>(image_pyramid::full_coordinate(c.y + static_cast<double>(c.dy),
                                                                                      level.height(), image.height())),
                               .size = size,
                               .angle = o.angle,
                               .response = c.response,
                               .octave = octave});
  }
}

}  // namespace orbis::features
