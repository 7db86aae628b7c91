// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The default vocabulary as text, which cmake/default_vocabulary.py makes from cmake/data/default_vocabulary.bin. That
/// file comes from
///
///     train_vocabulary train --textures 2000 --rooms 50 --views 12 --features 500
///         --branching 10 --depth 4 --seed 1 default_vocabulary.bin
#pragma once

#include <array>
#include <cstddef>

namespace orbis::places::detail {
#include <orbis/places/detail/default_vocabulary.inc>
}  // namespace orbis::places::detail
