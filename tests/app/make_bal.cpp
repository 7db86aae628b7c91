// SPDX-License-Identifier: BSD-3-Clause
//
// make_bal FILE CAMERAS POINTS SIGMA OUTLIERS: writes a generated problem of bundle adjustment.
#include <cstdio>
#include <cstdlib>

#include <orbis/io/bal.hpp>

#include "support/synthetic/bundle.hpp"

int main(int argc, char** argv) {
  if (argc != 6) return 1;
  const auto made = orbis::test::make_bal_problem({.cameras = std::atoi(argv[2]),
                                                   .points = std::atoi(argv[3]),
                                                   .pixel_sigma = std::atof(argv[4]),
                                                   .outlier_share = std::atof(argv[5])});
  const auto done = orbis::io::write_bal(argv[1], made.measured);
  if (done) return 0;
  std::fprintf(stderr, "%s\n", done.error().to_string().c_str());
  return 1;
}
