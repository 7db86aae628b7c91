// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <limits>
#include <vector>

#include <orbis/optimize/detail/minimal/five_point.hpp>

#include "optimize/support.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

struct five {
  std::array<vec3, 5> first, second;
  mat3 essential;
};

five random_five(random_bits& random, bool planar) {
  five f;
  // The second camera is some way off, with a similar view.
  const se3 T_second_first(so3::exp(test::random_vector(random, 0.4)), test::random_vector(random, 1.0));
  f.essential = hat<double>(T_second_first.translation()) * T_second_first.rotation_matrix();
  f.essential *= std::sqrt(2.0) / f.essential.norm();
  for (std::size_t i = 0; i != 5; ++i) {
    vec3 p = test::random_point_in_view(random);
    if (planar) p *= 3.0 / (p.z() + 0.2 * p.x());
    f.first[i] = p / p.z();
    f.second[i] = T_second_first * p;
  }
  return f;
}

double distance(const mat3& a, const mat3& b) { return std::min((a - b).norm(), (a + b).norm()); }

}  // namespace

TEST_CASE("The five-point method finds the true essential matrix, and others that are ones") {
  random_bits random(7);
  std::vector<double> errors;
  std::size_t number = 0;
  int wrong = 0;
  for (int trial = 0; trial != 3000; ++trial) {
    const five f = random_five(random, trial % 3 == 0);
    double nearest = std::numeric_limits<double>::infinity();
    for (const mat3& e : optimize::detail::five_point(f.first, f.second)) {
      ++number;
      nearest = std::min(nearest, distance(e, f.essential));
      for (std::size_t i = 0; i != 5; ++i)
        wrong += std::abs(f.second[i].normalized().dot(e * f.first[i].normalized())) > 1e-12;
      // Two singular values of 1, one of 0.
      wrong += !(std::abs(e.determinant()) < 1e-6) ||
               !((2.0 * e * e.transpose() * e - (e * e.transpose()).trace() * e).norm() < 1e-6);
    }
    errors.push_back(nearest);
  }
  std::sort(errors.begin(), errors.end());
  CHECK(errors[errors.size() / 2] < 1e-13);
  CHECK(errors[errors.size() * 99 / 100] < 1e-9);
  CHECK(std::count_if(errors.begin(), errors.end(), [](double e) { return !(e < 1e-6); }) <= 6);
  CHECK(wrong <= 12);
  CHECK(number > 2 * errors.size());
}

TEST_CASE("The five-point method has nothing to say about bad rays") {
  random_bits random(2);
  five f = random_five(random, false);
  f.first[2].x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(optimize::detail::five_point(f.first, f.second).empty());
  f = random_five(random, false);
  f.first[3] = f.first[1];
  f.second[3] = f.second[1];
  CHECK(optimize::detail::five_point(f.first, f.second).empty());
  for (std::size_t i = 0; i != 5; ++i) f.first[i] = f.second[i] = vec3(0.1, 0.2, 1.0);
  CHECK(optimize::detail::five_point(f.first, f.second).empty());
}
