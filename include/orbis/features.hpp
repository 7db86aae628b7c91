// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Keypoints, descriptors and matching.
///
/// | header | contents |
/// | --- | --- |
/// | `features/descriptor.hpp` | `keypoint`, `binary_descriptor`, `features` |
/// | `features/extractor.hpp` | concepts of extractors and their parts |
/// | `features/orb.hpp` | `orb_extractor`: ORB features, distributed evenly |
/// | `features/pyramid.hpp` | `image_pyramid`: an image at several scales |
/// | `features/grey.hpp` | conversion of colour and 16-bit images to 8-bit grey images |
/// | `features/hamming.hpp` | `hamming`, the distance between binary descriptors |
/// | `features/match.hpp` | `match`, `candidate`, concepts of sources and stages |
/// | `features/matcher.hpp` | matchers composed of a source and stages with `\|` |
/// | `features/stages.hpp` | stages: ratio test, cross check, distance, uniqueness, rotation |
/// | `features/brute_force.hpp` | source that compares all pairs |
/// | `features/windowed.hpp` | source that searches near predicted positions |
/// | `features/projected.hpp` | source that searches near the projections of known points |
/// | `features/project_points.hpp` | projection by a camera and its pose, for `projected` |
/// | `features/epipolar.hpp` | source that searches along epipolar lines |
/// | `features/epipolar_geometry.hpp` | epipolar lines between two images from any cameras |
/// | `features/stereo.hpp` | `stereo_matcher`: right-image coordinates of features in a stereo pair |
/// | `features/grid.hpp` | spatial index of keypoints |
/// | `features/depth.hpp` | depth at a keypoint and its standard deviation |
#pragma once

#include <orbis/features/brute_force.hpp>
#include <orbis/features/depth.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/epipolar.hpp>
#include <orbis/features/epipolar_geometry.hpp>
#include <orbis/features/extractor.hpp>
#include <orbis/features/grey.hpp>
#include <orbis/features/grid.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/features/match.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/features/project_points.hpp>
#include <orbis/features/projected.hpp>
#include <orbis/features/pyramid.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/features/stereo.hpp>
#include <orbis/features/windowed.hpp>
