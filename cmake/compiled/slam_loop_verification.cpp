// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/detail/compiled/loops.hpp>

namespace orbis::slam::detail {

template loop_check loop_verification::verify(const loop_verification::snapshot<compiled_descriptor>&,
                                              const compiled_rig&, const loop_options&);
template std::vector<loop_fusion::pair> loop_fusion::find_pairs(const loop_fusion::snapshot<compiled_descriptor>&,
                                                                const compiled_rig&, const loop_fusion_options&);

}  // namespace orbis::slam::detail
