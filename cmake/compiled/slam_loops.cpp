// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/detail/compiled/loops.hpp>
#include <orbis/slam/detail/loops/loop_closer.hpp>

namespace orbis::slam::detail {

template class loop_closer<camera::any_camera, compiled_descriptor, bag_of_words_places>;

}  // namespace orbis::slam::detail
