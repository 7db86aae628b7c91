// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Requirements on feature extractors, their descriptors and descriptor distances.
#pragma once

#include <concepts>

#include <orbis/features/extractor.hpp>
#include <orbis/features/hamming.hpp>

namespace orbis::slam {

/// The descriptor distance: `type` is the distance with which a map compares descriptors of type `D`. The default is
/// the Hamming distance. Specialise it for custom descriptors:
///
/// @code
///   template <>
///   struct orbis::slam::distance_of<my_descriptor> {
///     using type = my_distance;  // std::uint32_t operator()(const my_descriptor&, const my_descriptor&) const
///   };
/// @endcode
template <class D>
struct distance_of {
  using type = features::hamming;
};
template <class D>
using distance_of_t = typename distance_of<D>::type;

/// A feature descriptor: a value whose distance to another descriptor is an integer.
template <class D>
concept feature_descriptor = std::semiregular<D> && features::descriptor_distance<distance_of_t<D>, D>;

/// Finds features in a colour image: a callable `basic_features<D>(image_view<const rgb8>)`, with any descriptor `D`.
template <class E>
concept feature_extractor = features::feature_extractor<E> && feature_descriptor<features::extracted_descriptor<E>>;

/// The descriptor type of an extractor.
template <feature_extractor E>
using descriptor_of_t = features::extracted_descriptor<E>;

}  // namespace orbis::slam
