// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The exact image of a scene, before a sensor measures it.
#pragma once

#include <orbis/core/image.hpp>

namespace orbis::io::detail::synthetic {

/// The exact image at one moment: for each pixel the colour, the depth (metres) and the cosine of the angle between ray
/// and surface normal.
struct exact_view {
  image<rgb8> color;
  image<float> depth;
  image<float> cosine;
};

}  // namespace orbis::io::detail::synthetic
