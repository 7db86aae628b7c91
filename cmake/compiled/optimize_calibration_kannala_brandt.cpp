// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/optimize/detail/compiled/self_calibration.hpp>

ORBIS_SELF_CALIBRATION(, kannala_brandt);
