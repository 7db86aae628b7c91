// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/detail/compiled/essential_graph_functions.hpp>
