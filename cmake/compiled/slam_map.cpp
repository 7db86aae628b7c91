// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/detail/compiled/map_file_functions.hpp>

template class orbis::slam::basic_map<orbis::features::binary_descriptor<256>>;
