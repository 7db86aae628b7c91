// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/io/detail/compiled/stereo_recording_functions.hpp>
