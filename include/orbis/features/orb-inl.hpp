// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of orb.hpp.
#pragma once

#include <orbis/features/detail/extract/cover_first.hpp>
#include <orbis/features/detail/extract/fast.hpp>
#include <orbis/features/detail/extract/orientation.hpp>
#include <orbis/features/detail/extract/steered_brief.hpp>
#include <orbis/features/grey.hpp>
#include <orbis/features/orb.hpp>

namespace orbis::features {

template <corner_detector Detector, corner_selection Distribution, orientation_estimator Orientation,
          patch_descriptor Descriptor>
void basic_orb_extractor<Detector, Distribution, Orientation, Descriptor>::into(
    features_type& found, image_view<const std::uint8_t> image) const {
  auto memory = workspaces_.acquire();
  extract(found, *memory, memory->pyramid, image);
  workspaces_.release(std::move(memory));
}

template <corner_detector Detector, corner_selection Distribution, orientation_estimator Orientation,
          patch_descriptor Descriptor>
void basic_orb_extractor<Detector, Distribution, Orientation, Descriptor>::into(
    features_type& found, image_pyramid& pyramid, image_view<const std::uint8_t> image) const {
  auto memory = workspaces_.acquire();
  extract(found, *memory, pyramid, image);
  workspaces_.release(std::move(memory));
}

template <corner_detector Detector, corner_selection Distribution, orientation_estimator Orientation,
          patch_descriptor Descriptor>
void basic_orb_extractor<Detector, Distribution, Orientation, Descriptor>::into(features_type& found,
                                                                                image_view<const rgb8> image) const {
  auto memory = workspaces_.acquire();
  const auto pixels = static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height());
  if (memory->grey.size() < pixels) memory->grey.resize(pixels);
  const image_view<std::uint8_t> grey{memory->grey.data(), image.width(), image.height()};
  luma(image, grey);
  extract(found, *memory, memory->pyramid, grey);
  workspaces_.release(std::move(memory));
}

template <corner_detector Detector, corner_selection Distribution, orientation_estimator Orientation,
          patch_descriptor Descriptor>
void basic_orb_extractor<Detector, Distribution, Orientation, Descriptor>::extract(
    features_type& found, workspace& memory, image_pyramid& pyramid, image_view<const std::uint8_t> image) const {
  found.keypoints.clear();
  found.descriptors.clear();
  pyramid.build(image, options_.levels, static_cast<double>(options_.scale_factor), 2 * border + 1);
  const std::size_t levels = pyramid.size();
  if (levels == 0 || options_.max_features == 0) return;
  if (memory.levels.size() < levels) memory.levels.resize(levels);
  for (std::size_t level = 0; level != levels; ++level) {
    const image_view<const std::uint8_t> pixels = pyramid[level];
    level_corners& on = memory.levels[level];
    on.area = {border, border, pixels.width() - 2 * border, pixels.height() - 2 * border};
    on.scale = static_cast<double>(image.width()) / pixels.width();
    detect_(pixels, on.area, {options_.threshold, options_.min_threshold}, memory.detector, on.corners);
  }
  choose_(std::span{memory.levels}.first(levels), options_.max_features, memory.distribution);
  for (std::size_t level = 0; level != levels; ++level)
    describe(found, memory, pyramid[level], static_cast<int>(level), image);
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
