// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/io/detail/compiled/camera_file_functions.hpp>
