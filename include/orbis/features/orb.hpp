// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// ORB features that are distributed evenly over the image.
///
/// Source: Rublee, Rabaud, Konolige, Bradski, "ORB: an efficient alternative to SIFT or SURF", ICCV 2011. The paper
/// selects the strongest corners, which tend to cluster; this extractor covers the image first.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/detail/extract/orb_parts.hpp>
#include <orbis/features/detail/extract/workspace_pool.hpp>
#include <orbis/features/extractor.hpp>
#include <orbis/features/pyramid.hpp>

namespace orbis::features {

/// The parts of `orb_extractor`; see `extractor.hpp` for the concepts that replacements must satisfy.
/// - `fast9` finds FAST-9/16 corners;
/// - `cover_first` selects corners that cover the image, then the strongest;
/// - `intensity_centroid` orients keypoints towards the intensity centroid;
/// - `steered_brief` describes keypoints with ORB's pattern, rotated to their orientation.
using detail::fast9, detail::cover_first, detail::intensity_centroid, detail::steered_brief;

/// Options of an ORB extractor.
struct orb_options {
  int max_features = 1000;    ///< maximum number of features
  int levels = 8;             ///< number of pyramid levels; levels too small for a patch are omitted
  float scale_factor = 1.2F;  ///< ratio of the image sizes of successive levels, > 1
  int threshold = 14;         ///< minimum brightness difference of a corner (in the slightly smoothed image)
  int min_threshold = 3;      ///< threshold in cells where `threshold` finds no corner; at most `threshold`
};

/// Finds keypoints on the levels of an image pyramid and describes them. Detection, selection, orientation and
/// description are template parameters. Concurrent calls on a const object are allowed. The extractor reuses its
/// working memory, one workspace per concurrent call. The library orbis::compiled contains the extractor with the
/// default parts; for other parts, include orb-inl.hpp.
template <corner_detector Detector = fast9, corner_selection Distribution = cover_first,
          orientation_estimator Orientation = intensity_centroid, patch_descriptor Descriptor = steered_brief>
class basic_orb_extractor {
 public:
  using descriptor = typename Descriptor::descriptor;
  using features_type = basic_features<descriptor>;

  /// Minimum distance of a keypoint from the image edge, pixels of its level.
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

  /// Returns the features of a grey image, ordered by level, then from top to bottom. An image with a side of less than
  /// 2 `border` + 1 pixels (39 by default) has no features. O(pixels + features).
  [[nodiscard]] features_type operator()(image_view<const std::uint8_t> image) const {
    features_type found;
    into(found, image);
    return found;
  }
  /// Returns the features of a colour image, converted with `luma`.
  [[nodiscard]] features_type operator()(image_view<const rgb8> image) const {
    features_type found;
    into(found, image);
    return found;
  }
  /// Deleted: convert 16-bit images with `narrow` first, which needs their value range.
  features_type operator()(image_view<const std::uint16_t> image) const = delete;

  /// Replaces the contents of `found` with the features of an image. Allocates nothing if a previous image had the
  /// same size and number of corners.
  void into(features_type& found, image_view<const std::uint8_t> image) const;
  void into(features_type& found, image_view<const rgb8> image) const;
  /// As above; also returns the image pyramid in `pyramid`: a keypoint's octave is its level in the pyramid.
  void into(features_type& found, image_pyramid& pyramid, image_view<const std::uint8_t> image) const;

 private:
  struct workspace {
    std::vector<std::uint8_t> grey;
    image_pyramid pyramid;
    std::vector<level_corners> levels;
    typename Detector::workspace detector;
    typename Distribution::workspace distribution;
    typename Descriptor::workspace descriptor;
  };

  void extract(features_type& found, workspace& memory, image_pyramid& pyramid,
               image_view<const std::uint8_t> image) const;
  void describe(features_type& found, workspace& memory, image_view<const std::uint8_t> level, int octave,
                image_view<const std::uint8_t> image) const;

  orb_options options_{};
  [[no_unique_address]] Detector detect_{};
  [[no_unique_address]] Distribution choose_{};
  [[no_unique_address]] Orientation orient_{};
  [[no_unique_address]] Descriptor describe_{};
  mutable detail::workspace_pool<workspace> workspaces_;
};

/// ORB features with the default parts.
using orb_extractor = basic_orb_extractor<>;

}  // namespace orbis::features

#ifndef ORBIS_COMPILED
#include <orbis/features/orb-inl.hpp>
#endif
