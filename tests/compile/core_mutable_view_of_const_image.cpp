// error: image_view
// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/core/image.hpp>

orbis::image_view<int> f(const orbis::image<int>& i) { return i; }
