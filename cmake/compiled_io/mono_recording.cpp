// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/io/detail/compiled/mono_recording_functions.hpp>
