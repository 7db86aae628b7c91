// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The sensor of programs that learn at run time which images they have.
#pragma once

#include <cstddef>

#include <orbis/slam/frame.hpp>
#include <orbis/slam/monocular.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/sensor.hpp>
#include <orbis/slam/stereo.hpp>

namespace orbis::slam {

/// Takes colour with depth, a stereo pair, or one image, whichever it is given; the last only with
/// `options::scale_is_measured` off (`monocular_options`). One system is to be given one kind of images.
struct any_sensor : rgbd, stereo, monocular {
  static constexpr scale_source scale = scale_source::options;
  using monocular::measure;
  using rgbd::measure;
  using stereo::measure;

  template <feature_descriptor D>
  [[nodiscard]] static std::size_t begins_map(const basic_frame<D>& f, const options& settings) {
    return settings.scale_is_measured ? rgbd::begins_map(f, settings) : monocular::begins_map(f, settings);
  }
};

}  // namespace orbis::slam
