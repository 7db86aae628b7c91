// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <limits>
#include <vector>

#include <Eigen/Geometry>

#include <orbis/optimize/alignment.hpp>

#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

struct pairs {
  std::vector<vec3> from, to;
};

template <class Transform>
pairs make_pairs(std::uint64_t seed, const Transform& truth, std::size_t n, double outliers, double noise) {
  random_bits random(seed);
  pairs p;
  for (std::size_t i = 0; i != n; ++i) {
    p.from.push_back(test::random_vector(random, 2.0));
    if (static_cast<double>(i) < (1.0 - outliers) * static_cast<double>(n))
      p.to.push_back(truth * p.from.back() + test::random_vector(random, noise));
    else
      p.to.push_back(test::random_vector(random, 4.0));
  }
  return p;
}

template <class Transform>
double difference(const Transform& a, const Transform& b) {
  return (a.to_matrix() - b.to_matrix()).norm();
}

}  // namespace

TEST_CASE("Alignment finds a rigid transform among 80 percent wrong pairs, and exactly its inliers") {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    random_bits random(seed + 1000);
    const se3 truth = test::random_pose(random);
    const pairs p = make_pairs(seed, truth, 200, 0.8, 0.01);
    const auto found = optimize::estimate_alignment(p.from, p.to, {.threshold = 0.05, .seed = seed});
    REQUIRE(found.has_value());
    CHECK(difference(found->T_to_from, truth) < 0.03);
    CHECK(found->inliers.size() >= 40);
    std::vector<std::uint32_t> expected;
    for (std::uint32_t i = 0; i != p.from.size(); ++i)
      if ((found->T_to_from * p.from[i] - p.to[i]).norm() < 0.05) expected.push_back(i);
    CHECK(found->inliers == expected);
  }
}

TEST_CASE("Alignment finds a similarity among wrong pairs") {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    random_bits random(seed + 2000);
    const sim3 truth(test::random_pose(random).rotation(), test::random_vector(random, 3.0), random.uniform(0.5, 2.0));
    const pairs p = make_pairs(seed, truth, 200, 0.7, 0.0);
    const auto found = optimize::estimate_alignment<sim3>(p.from, p.to, {.threshold = 0.05, .seed = seed});
    REQUIRE(found.has_value());
    CHECK(difference(found->T_to_from, truth) < 1e-2);  // a wrong pair may be near by chance
    CHECK(found->inliers.size() >= 60);
  }
}

TEST_CASE("Alignment moves with its points") {
  random_bits random(5);
  const se3 truth = test::random_pose(random), before = test::random_pose(random), after = test::random_pose(random);
  const pairs p = make_pairs(17, truth, 100, 0.5, 0.01);
  pairs moved;
  for (const vec3& x : p.from) moved.from.push_back(before * x);
  for (const vec3& x : p.to) moved.to.push_back(after * x);
  const auto a = optimize::estimate_alignment(p.from, p.to);
  const auto b = optimize::estimate_alignment(moved.from, moved.to);
  REQUIRE(a.has_value());
  REQUIRE(b.has_value());
  CHECK(difference(b->T_to_from, after * a->T_to_from * before.inverse()) < 1e-9);
  CHECK(a->inliers == b->inliers);
  // Twice the same is the same.
  const auto again = optimize::estimate_alignment(p.from, p.to);
  REQUIRE(again.has_value());
  CHECK(difference(a->T_to_from, again->T_to_from) == 0.0);
}

TEST_CASE("Alignment weighs pairs by their deviations") {
  random_bits random(3);
  const se3 truth = test::random_pose(random);
  std::vector<vec3> from, to;
  std::vector<double> deviations;
  for (int i = 0; i != 400; ++i) {
    from.push_back(test::random_vector(random, 2.0));
    deviations.push_back(i % 2 == 0 ? 0.001 : 0.05);
    to.push_back(truth * from.back() + deviations.back() * vec3(random.normal(), random.normal(), random.normal()));
  }
  const auto plain = optimize::estimate_alignment(from, to, {.threshold = 0.15});
  const auto weighted = optimize::estimate_alignment(from, to, {.threshold = 4.0, .deviations = deviations});
  REQUIRE(plain.has_value());
  REQUIRE(weighted.has_value());
  CHECK(difference(weighted->T_to_from, truth) < 0.2 * difference(plain->T_to_from, truth));
  CHECK(weighted->inliers.size() > 390);
}

TEST_CASE("Alignment takes pairs without a deviation for outliers") {
  const pairs p = make_pairs(7, se3(so3::exp(vec3(0.1, 0.2, 0.3)), vec3(1, 2, 3)), 40, 0.0, 0.001);
  std::vector<double> deviations(40, 0.01);
  deviations[3] = std::numeric_limits<double>::infinity();
  deviations[5] = std::numeric_limits<double>::quiet_NaN();
  deviations[9] = 0.0;
  const auto found = optimize::estimate_alignment(p.from, p.to, {.threshold = 3.0, .deviations = deviations});
  REQUIRE(found.has_value());
  std::vector<std::uint32_t> expected;
  for (std::uint32_t i = 0; i != 40; ++i)
    if (i != 3 && i != 5 && i != 9) expected.push_back(i);
  CHECK(found->inliers == expected);
}

TEST_CASE("Alignment has as many inliers as are asked for, or no answer") {
  CHECK(test::keeps_to_min_inliers([](std::size_t asked, std::size_t seed) {
    const pairs p = make_pairs(seed, se3(), 60, 0.3, 0.05);
    return optimize::estimate_alignment(p.from, p.to,
                                        {.threshold = 0.05, .max_iterations = 200, .min_inliers = asked, .seed = seed});
  }));
}

TEST_CASE("Alignment says why it has no answer") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto why = [](const auto& from, const auto& to) {
    return optimize::estimate_alignment(from, to, {.max_iterations = 200}).error();
  };
  std::vector<vec3> line, place(20, vec3(1, 2, 3)), nans(20, vec3(nan, 0, 0));
  for (int i = 0; i != 20; ++i) line.emplace_back(1.0 + i, 2.0 - i, 0.5 * i);
  CHECK(why(line, line).code == errc::degenerate);
  CHECK(why(line, line).message == "all points are collinear or coincident");
  CHECK(why(place, place).message == "all points are collinear or coincident");
  CHECK(why(nans, line).message == "only 0 of 20 pairs are finite; three are needed");
  CHECK(why(std::vector<vec3>(2, vec3::Zero()), std::vector<vec3>(2, vec3::Zero())).code == errc::no_data);
  CHECK(why(std::vector<vec3>(3, vec3::Zero()), line).code == errc::invalid_argument);
  for (const double bad : test::bad_thresholds)
    CHECK(optimize::estimate_alignment(line, line, {.threshold = bad}).error().code == errc::invalid_argument);
  random_bits random(1);
  std::vector<vec3> a, b;
  for (int i = 0; i != 50; ++i) {
    a.push_back(test::random_vector(random, 2.0));
    b.push_back(test::random_vector(random, 2.0));
  }
  CHECK(optimize::estimate_alignment(a, b, {.max_iterations = 200, .min_inliers = 20}).error().code ==
        errc::degenerate);
}

TEST_CASE("Absolute orientation finds the rigid transform and agrees with Eigen's umeyama under noise") {
  random_bits random(7);
  for (int trial = 0; trial < 50; ++trial) {
    const se3 truth = test::random_pose(random);
    std::vector<vec3> from, exact, noisy;
    for (int i = 0; i < 20; ++i) {
      from.push_back(test::random_vector(random, 2.0));
      exact.push_back(truth * from.back());
      noisy.push_back(exact.back() + test::random_vector(random, 0.05));
    }
    const auto found = optimize::absolute_orientation(from, exact);
    REQUIRE(found.has_value());
    CHECK(test::angle_between(*found, truth) < 1e-9);
    CHECK(test::distance_between(*found, truth) < 1e-9);

    Eigen::Matrix3Xd a(3, 20), b(3, 20);
    for (int i = 0; i < 20; ++i) {
      a.col(i) = from[static_cast<std::size_t>(i)];
      b.col(i) = noisy[static_cast<std::size_t>(i)];
    }
    const Eigen::Matrix4d rigid = Eigen::umeyama(a, b, false);
    const Eigen::Matrix4d scaled = Eigen::umeyama(a, b, true);
    CHECK((optimize::absolute_orientation(from, noisy)->to_matrix() - rigid).norm() < 1e-9);
    const auto s = optimize::absolute_orientation_with_scale(from, noisy);
    REQUIRE(s.has_value());
    CHECK((s->scale() * s->rotation_matrix() - scaled.topLeftCorner<3, 3>()).norm() < 1e-9);
    CHECK((s->translation() - scaled.topRightCorner<3, 1>()).norm() < 1e-9);
  }
}

TEST_CASE("Absolute orientation counts a pair as often as its weight says") {
  random_bits random(8);
  std::vector<vec3> from, to, from_often, to_often;
  std::vector<double> weights;
  for (int i = 0; i < 12; ++i) {
    from.push_back(test::random_vector(random, 2.0));
    to.push_back(test::random_vector(random, 2.0));
    weights.push_back(i % 4);
    for (int times = 0; times != i % 4; ++times) {
      from_often.push_back(from.back());
      to_often.push_back(to.back());
    }
  }
  const auto found = optimize::absolute_orientation_with_scale(from, to, weights);
  const auto often = optimize::absolute_orientation_with_scale(from_often, to_often);
  REQUIRE((found.has_value() && often.has_value()));
  CHECK((found->to_matrix() - often->to_matrix()).norm() < 1e-9);
  weights.back() = -1.0;
  CHECK(optimize::absolute_orientation_with_scale(from, to, weights).error().code == errc::invalid_argument);
  weights.back() = std::numeric_limits<double>::quiet_NaN();
  CHECK(optimize::absolute_orientation_with_scale(from, to, weights).error().code == errc::invalid_argument);
  weights.pop_back();
  CHECK(optimize::absolute_orientation_with_scale(from, to, weights).error().code == errc::invalid_argument);
}

TEST_CASE("Absolute orientation takes any point type and planar points") {
  const std::vector<std::array<float, 3>> from{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {1, 1, 0}};
  std::vector<vec3> to;
  for (const auto& p : from) to.emplace_back(-p[1] + 5.0, p[0], p[2]);
  const auto found = optimize::absolute_orientation(from, to);
  REQUIRE(found.has_value());
  CHECK((*found * vec3(1, 1, 1) - vec3(4, 1, 1)).norm() < 1e-9);
}

TEST_CASE("Absolute orientation says what is wrong with degenerate points") {
  std::vector<vec3> line, point, few(2, vec3::Zero());
  for (int i = 0; i < 10; ++i) {
    line.emplace_back(1.0 + i, 2.0 - 3.0 * i, 0.5 * i);
    point.emplace_back(1.0, 2.0, 3.0);
  }
  CHECK(optimize::absolute_orientation(line, line).error().code == errc::degenerate);
  CHECK(optimize::absolute_orientation(point, point).error().code == errc::degenerate);
  CHECK(optimize::absolute_orientation_with_scale(point, line).error().code == errc::degenerate);
  CHECK(optimize::absolute_orientation(few, few).error().code == errc::no_data);
  CHECK(optimize::absolute_orientation(few, line).error().code == errc::invalid_argument);
  std::vector<vec3> nan{vec3(0, 0, 0), vec3(1, 0, 0), vec3(0, 1, 0), vec3(0, 0, 1)};
  nan[2].x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(optimize::absolute_orientation(nan, nan).error().code == errc::degenerate);
}
