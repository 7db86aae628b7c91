// SPDX-License-Identifier: BSD-3-Clause
#include <limits>
#include <vector>

#include <orbis/core/se3.hpp>
#include <orbis/optimize/two_view-inl.hpp>

#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

/// A plane seen from two places, at z = 1.
struct plane_scene {
  optimize::plane_motion truth;
  mat3 homography;

  [[nodiscard]] vec2 map(const vec2& p) const { return (homography * p.homogeneous()).hnormalized(); }
};

plane_scene make_scene(random_bits& random) {
  plane_scene s;
  s.truth.R_second_first = so3::exp(test::random_vector(random, 0.3));
  s.truth.translation = test::random_vector(random, 0.3);
  s.truth.normal = (vec3::UnitZ() + test::random_vector(random, 0.5)).normalized();
  s.homography = s.truth.R_second_first.rotation_matrix() + s.truth.translation * s.truth.normal.transpose();
  return s;
}

mat3 pixels_from_rays() {
  mat3 k;
  k << 525, 0, 320, 0, 525, 240, 0, 0, 1;
  return k;
}

struct matches {
  mat3 homography;
  std::vector<vec2> first, second;
};

matches make_matches(std::uint64_t seed, std::size_t n, double outliers, double noise) {
  random_bits random(seed);
  const mat3 k = pixels_from_rays();
  matches m;
  m.homography = k * make_scene(random).homography * k.inverse();
  m.homography /= m.homography(2, 2);
  for (std::size_t i = 0; i != n; ++i) {
    const vec2 p(random.uniform(0, 640), random.uniform(0, 480));
    const vec2 noise_first(random.normal(), random.normal()), noise_second(random.normal(), random.normal());
    const vec2 anywhere(random.uniform(0, 640), random.uniform(0, 480));
    m.first.push_back(p + noise * noise_first);
    m.second.push_back(static_cast<double>(i) < (1.0 - outliers) * static_cast<double>(n)
                           ? vec2((m.homography * p.homogeneous()).hnormalized() + noise * noise_second)
                           : anywhere);
  }
  return m;
}

}  // namespace

TEST_CASE("Four matches determine a homography") {
  random_bits random(1);
  int found = 0;
  double worst = 0.0;
  for (int trial = 0; trial != 3000; ++trial) {
    const plane_scene s = make_scene(random);
    std::array<vec2, 4> first, second;
    for (std::size_t i = 0; i != 4; ++i) {
      first[i] = vec2(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5));
      second[i] = s.map(first[i]);
    }
    const auto h = optimize::detail::homography_of_four(first, second);
    if (!h) continue;
    ++found;
    for (std::size_t i = 0; i != 4; ++i)
      worst = std::max(worst, ((*h * first[i].homogeneous()).hnormalized() - second[i]).norm());
  }
  CHECK(found > 2900);  // of random points some are on a line
  CHECK(worst < 1e-10);
  const std::array<vec2, 4> line{vec2(0, 0), vec2(1, 1), vec2(2, 2), vec2(0, 1)};
  const std::array<vec2, 4> square{vec2(0, 0), vec2(1, 0), vec2(1, 1), vec2(0, 1)};
  const std::array<vec2, 4> crossed{vec2(0, 0), vec2(1, 1), vec2(1, 0), vec2(0, 1)};
  CHECK_FALSE(optimize::detail::homography_of_four(line, square).has_value());
  CHECK_FALSE(optimize::detail::homography_of_four(square, line).has_value());
  CHECK_FALSE(optimize::detail::homography_of_four(square, crossed).has_value());
}

TEST_CASE("The homography is found among 60 percent wrong matches, and exactly its inliers") {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const matches m = make_matches(seed, 300, 0.6, 1.0);
    const auto found = optimize::estimate_homography(m.first, m.second, {.threshold = 4.0, .seed = seed});
    REQUIRE(found.has_value());
    CHECK(found->inliers.size() > 110);
    double worst = 0.0;
    for (const vec2& corner : {vec2(0, 0), vec2(640, 0), vec2(0, 480), vec2(640, 480)})
      worst = std::max(worst, ((found->H_second_first * corner.homogeneous()).hnormalized() -
                               (m.homography * corner.homogeneous()).hnormalized())
                                  .norm());
    CHECK(worst < 8.0);  // a corner may lie where a pixel becomes three
    // By what is looked for, the truth is no better than a descent with a threshold can tell: the sum has a dent
    // wherever a match comes within the threshold, and ends in one of them.
    const auto score = [&](const mat3& h) {
      double sum = 0.0;
      for (std::size_t i = 0; i != m.first.size(); ++i)
        sum += std::min(16.0,
                        0.5 * (((h * m.first[i].homogeneous()).hnormalized() - m.second[i]).squaredNorm() +
                               ((h.inverse() * m.second[i].homogeneous()).hnormalized() - m.first[i]).squaredNorm()));
      return sum;
    };
    CHECK(score(found->H_second_first) <= 1.005 * score(m.homography));
    std::vector<std::uint32_t> expected;
    const mat3 back = found->H_second_first.inverse();
    for (std::uint32_t i = 0; i != m.first.size(); ++i) {
      const double e = ((found->H_second_first * m.first[i].homogeneous()).hnormalized() - m.second[i]).squaredNorm() +
                       ((back * m.second[i].homogeneous()).hnormalized() - m.first[i]).squaredNorm();
      if (0.5 * e < 16.0) expected.push_back(i);
    }
    CHECK(found->inliers == expected);
  }
}

TEST_CASE("The homography is exact without noise and the same again") {
  const matches m = make_matches(3, 100, 0.0, 0.0);
  const auto a = optimize::estimate_homography(m.first, m.second);
  const auto b = optimize::estimate_homography(m.first, m.second);
  REQUIRE(a.has_value());
  REQUIRE(b.has_value());
  CHECK((a->H_second_first - m.homography).norm() < 1e-9 * m.homography.norm());
  CHECK(a->H_second_first == b->H_second_first);
  CHECK(a->inliers.size() == 100);
  CHECK(a->rmse < 1e-9);
}

TEST_CASE("A homography decomposes into the motion it was made of and another one") {
  random_bits random(9);
  for (int trial = 0; trial != 2000; ++trial) {
    const plane_scene s = make_scene(random);
    const double scale = trial % 2 == 0 ? 2.0 : -0.7;
    const auto motions = optimize::decompose_homography(scale * s.homography);
    REQUIRE(motions.has_value());
    CHECK(motions->size() == 2);
    double nearest = 10.0;
    for (const auto& m : *motions) {
      nearest =
          std::min(nearest, (m.R_second_first.inverse() * s.truth.R_second_first).angle() +
                                (m.translation - s.truth.translation).norm() + (m.normal - s.truth.normal).norm());
      const mat3 again = m.R_second_first.rotation_matrix() + m.translation * m.normal.transpose();
      CHECK((again - s.homography).norm() < 1e-6);
      CHECK(m.normal.z() > 0.0);
    }
    CHECK(nearest < 1e-5);
  }
  const mat3 turn = so3::exp(vec3(0.1, 0.2, -0.3)).rotation_matrix();
  const auto pure = optimize::decompose_homography(turn);
  REQUIRE(pure.has_value());
  CHECK(pure->size() == 1);
  CHECK(pure->front().translation.norm() < 1e-9);
  CHECK((pure->front().R_second_first.rotation_matrix() - turn).norm() < 1e-9);
  CHECK_FALSE(optimize::decompose_homography(mat3::Zero()).has_value());
  CHECK_FALSE(optimize::decompose_homography(vec3(1, 1, 0).asDiagonal()).has_value());
  CHECK_FALSE(optimize::decompose_homography(mat3::Constant(std::numeric_limits<double>::quiet_NaN())).has_value());
}

TEST_CASE("The homography has as many inliers as are asked for, or there is none") {
  CHECK(test::keeps_to_min_inliers([](std::size_t asked, std::size_t seed) {
    const matches m = make_matches(seed, 60, 0.3, 2.0);
    return optimize::estimate_homography(m.first, m.second,
                                         {.threshold = 2.0, .max_iterations = 200, .min_inliers = asked, .seed = seed});
  }));
}

TEST_CASE("The homography says why there is none") {
  const auto why = [](const std::vector<vec2>& first, const std::vector<vec2>& second) {
    const auto found = optimize::estimate_homography(first, second, {.max_iterations = 200, .min_inliers = 40});
    return found ? error{} : found.error();
  };
  const matches m = make_matches(3, 50, 1.0, 0.0);
  CHECK(why(m.first, m.second).code == errc::degenerate);
  CHECK(why(m.first, m.second).message.find("no model has enough inliers") == 0);
  for (const double bad : test::bad_thresholds)
    CHECK(optimize::estimate_homography(m.first, m.second, {.threshold = bad}).error().code == errc::invalid_argument);
  std::vector<vec2> line, nans(50, vec2::Constant(std::numeric_limits<double>::quiet_NaN()));
  for (int i = 0; i != 50; ++i) line.emplace_back(10.0 + i, 20.0 - 2.0 * i);
  CHECK(why(line, m.second).message == "all points are collinear or coincident");
  CHECK(why(m.first, line).message == "all points are collinear or coincident");
  CHECK(why(std::vector<vec2>(50, vec2(1, 2)), std::vector<vec2>(50, vec2(1, 2))).code == errc::degenerate);
  CHECK(why(nans, m.second).message == "only 0 of 50 matches are finite; four are needed");
  CHECK(why({vec2(0, 0)}, {vec2(0, 0)}).code == errc::no_data);
  CHECK(why({vec2(0, 0)}, m.second).code == errc::invalid_argument);
}

TEST_CASE("Matches on the other side of the horizon are no inliers") {
  matches m;
  m.homography << 1.0, 0.1, 5.0, 0.0, 1.0, 8.0, 0.0, -0.004, 1.0;  // the horizon is at y = 250
  std::vector<std::uint32_t> expected;
  for (int y = 10; y < 480; y += 30)
    for (int x = 10; x < 640; x += 60) {
      const vec2 p(x, y);
      if (y < 250) expected.push_back(static_cast<std::uint32_t>(m.first.size()));
      m.first.push_back(p);
      m.second.push_back((m.homography * p.homogeneous()).hnormalized());
    }
  const auto found = optimize::estimate_homography(m.first, m.second, {.threshold = 0.5, .seed = 1});
  REQUIRE(found.has_value());
  const bool is_above = found->inliers == expected;
  CHECK((is_above || found->inliers.size() == m.first.size() - expected.size()));
  CHECK((found->H_second_first - m.homography).norm() < 1e-6 * m.homography.norm());
}
