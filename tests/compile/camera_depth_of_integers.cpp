// error: depth_source
// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/camera/cloud.hpp>

struct raw_values {  // stored integers are not metres
  int width() const { return 640; }
  int height() const { return 480; }
  unsigned short operator()(int, int) const { return 1000; }
};

void f(const orbis::camera::ray_table& rays) { (void)orbis::camera::unproject_depth(orbis::seq, raw_values{}, rays); }
