// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <numeric>

#include <orbis/optimize/pose_graph-inl.hpp>

#include "pose_graphs.hpp"
#include "support.hpp"
#include "support/catch.hpp"
#include "support/data.hpp"

using namespace orbis;
using namespace orbis::optimize;

namespace {

using edge = pose_graph_edge<se3>;

/// The cost as the documentation defines it.
double cost_of(const std::vector<se3>& vertices, const std::vector<io::g2o_edge>& edges) {
  double sum = 0.0;
  for (const io::g2o_edge& e : edges) {
    const vec6 r = quaternion_between::residual(vertices[e.from], vertices[e.to], e.measurement);
    sum += 0.5 * r.dot(e.information * r);
  }
  return sum;
}

std::vector<edge> chain(std::size_t count) {
  std::vector<edge> edges;
  for (std::uint32_t i = 1; i < count; ++i)
    edges.push_back({.from = i - 1, .to = i, .measurement = se3{so3{}, vec3(1, 0, 0)}});
  return edges;
}

}  // namespace

TEST_CASE("Every policy of damping and execution finds the same minimum, near the truth") {
  for (const test::synthetic_graph& made : test::small_graphs()) {
    const auto& edges = made.measured.edges;
    const auto run = [&](auto damping, std::vector<se3>& vertices, const auto& policy) {
      vertices = made.measured.vertices;
      const auto s = test::solve(policy, vertices, edges, {.relative_tolerance = 1e-9, .fixed = made.measured.fixed},
                                 trivial{}, damping);
      CHECK(s.status == pose_graph_status::converged);
      CHECK(s.initial_cost == Approx(cost_of(made.measured.vertices, edges)).epsilon(1e-9));
      CHECK(s.final_cost == Approx(cost_of(vertices, edges)).epsilon(1e-9));
      CHECK(s.iterations <= s.factorizations);
      return s;
    };
    std::vector<se3> reference, vertices;
    const double best = run(gauss_newton{}, reference, seq).final_cost;
    // Six numbers for each edge against six for each vertex.
    const double freedom = 6.0 * (static_cast<double>(edges.size()) - static_cast<double>(reference.size()) + 1.0);
    CHECK(2.0 * best == Approx(freedom).epsilon(0.15));
    CHECK(test::position_error(reference, made.truth) < 0.3 * test::position_error(made.measured.vertices, made.truth));

    const auto same = [&](auto damping) {
      std::vector<se3> again;
      const auto s = run(damping, vertices, seq);
      CHECK(s.final_cost == Approx(best).epsilon(1e-6));
      CHECK(test::position_error(vertices, reference) < 1e-3);
      const auto t = run(damping, again, par.with(3));
      CHECK(t.iterations == s.iterations);
      CHECK(t.final_cost == s.final_cost);
      CHECK(test::same_bits(vertices, again));
    };
    same(gauss_newton{});
    same(levenberg_marquardt{});
    same(dogleg{});
  }
}

TEST_CASE("sphere.g2o: the chi2 of g2o") {
  ORBIS_NEEDS_DATA("pose_graph/sphere.g2o");
  const auto graph = io::read_g2o(test::data_dir() / "pose_graph/sphere.g2o");
  REQUIRE(graph.has_value());
  REQUIRE(graph->vertices.size() == 2500);
  const auto check = [&](auto damping) {
    std::vector<se3> vertices = graph->vertices;
    const auto s = test::solve(seq, vertices, graph->edges, {}, trivial{}, damping);
    CHECK(s.status == pose_graph_status::converged);
    CHECK(2.0 * s.final_cost == Approx(4.43607e4).epsilon(1e-5));
    CHECK(s.iterations <= 15);
    CHECK(vertices[0].translation() == graph->vertices[0].translation());
  };
  check(gauss_newton{});
  check(levenberg_marquardt{});
  check(dogleg{});
}

TEST_CASE("The answer moves with the world and does not depend on the order of the edges") {
  random_bits random{361};
  for (const test::synthetic_graph& made : test::small_graphs()) {
    const pose_graph_options options{.relative_tolerance = 1e-12, .fixed = made.measured.fixed};
    std::vector<se3> plain = made.measured.vertices;
    const auto s = test::solve<dogleg>(seq, plain, made.measured.edges, options);

    const se3 motion = test::random_pose(random, 100.0);
    std::vector<se3> moved = made.measured.vertices;
    for (se3& v : moved) v = motion * v;
    const auto t = test::solve<dogleg>(seq, moved, made.measured.edges, options);
    CHECK(t.final_cost == Approx(s.final_cost).epsilon(1e-9));
    for (se3& v : moved) v = motion.inverse() * v;
    CHECK(test::position_error(moved, plain) < 1e-5);

    auto edges = made.measured.edges;
    for (std::uint32_t i = static_cast<std::uint32_t>(edges.size()); i > 1; --i)
      std::swap(edges[i - 1], edges[random.below(i)]);
    std::vector<se3> shuffled = made.measured.vertices;
    const auto u = test::solve<dogleg>(seq, shuffled, edges, options);
    CHECK(u.final_cost == Approx(s.final_cost).epsilon(1e-9));
    CHECK(test::position_error(shuffled, plain) < 1e-5);
  }
}

TEST_CASE("Edges between the same vertices add up, either way round") {
  random_bits random{362};
  const mat6 weak = vec6(vec6::Constant(2.0)).asDiagonal();
  const mat6 strong = vec6(vec6::Constant(6.0)).asDiagonal();
  std::vector<edge> edges{{.from = 0, .to = 1, .measurement = se3{so3{}, vec3(1, 0, 0)}, .information = weak},
                          {.from = 1, .to = 0, .measurement = se3{so3{}, vec3(-2, 0, 0)}, .information = strong},
                          {.from = 0, .to = 1, .measurement = se3{so3{}, vec3(1, 0, 0)}, .information = weak}};
  std::vector<se3> vertices{se3{}, test::random_pose(random)};
  const auto s = test::solve(seq, vertices, edges, {.relative_tolerance = 1e-12});
  CHECK(s.status == pose_graph_status::converged);
  CHECK((vertices[1].translation() - vec3(1.6, 0, 0)).norm() < 1e-6);  // (2 + 2) * 1 + 6 * 2 over 10
  CHECK(vertices[1].rotation().angle() < 1e-6);
  CHECK(s.final_cost == Approx(0.5 * (4.0 * 0.36 + 6.0 * 0.16)));
}

TEST_CASE("A robust loss keeps wrong closures from pulling") {
  auto made = test::make_pose_graph({.shape = test::graph_shape::torus,
                                     .poses_per_turn = 16,
                                     .turns = 20,
                                     .radius = 10.0,
                                     .translation_sigma = 0.02,
                                     .rotation_sigma = 0.004,
                                     .outlier_share = 0.05,
                                     .seed = 5});
  REQUIRE(std::accumulate(made.wrong.begin(), made.wrong.end(), 0) > 5);
  const pose_graph_options options{.fixed = made.measured.fixed};
  std::vector<se3> squares = made.measured.vertices, robust = squares, huberised = squares;
  test::solve(seq, squares, made.measured.edges, options);
  const auto s = test::solve(seq, robust, made.measured.edges, options, cauchy{3.0});
  test::solve(seq, huberised, made.measured.edges, options, huber{3.0});
  CHECK(s.final_cost < s.initial_cost);
  CHECK(test::position_error(squares, made.truth) > 0.5);
  // As good as if someone had told which ones are wrong.
  std::vector<io::g2o_edge> right;
  for (std::size_t k = 0; k != made.wrong.size(); ++k)
    if (made.wrong[k] == 0) right.push_back(made.measured.edges[k]);
  std::vector<se3> told = made.measured.vertices;
  test::solve(seq, told, right, options);
  CHECK(test::position_error(robust, made.truth) < 1.3 * test::position_error(told, made.truth));
  CHECK(test::position_error(huberised, made.truth) < 0.3 * test::position_error(squares, made.truth));
  // An outlier is one by its weight.
  for (std::size_t k = 0; k != made.wrong.size(); ++k) {
    const io::g2o_edge& e = made.measured.edges[k];
    const vec6 r = quaternion_between::residual(robust[e.from], robust[e.to], e.measurement);
    CHECK((cauchy{3.0}.weight(r.dot(e.information * r)) < 0.1) == (made.wrong[k] != 0));
  }
}

TEST_CASE("Fixed vertices stay, to the bit, and so do those without edges") {
  const auto made = test::small_graphs()[0];
  std::vector<std::uint8_t> fixed(made.truth.size(), 0);
  std::vector<se3> vertices = made.measured.vertices;
  for (std::size_t i = 0; i < fixed.size(); i += 40) {
    fixed[i] = 1;
    vertices[i] = made.truth[i];
  }
  vertices.push_back(se3{so3{}, vec3(1e5, 0, 0)});
  fixed.push_back(0);
  const auto before = vertices;
  const auto s = test::solve(seq, vertices, made.measured.edges, {.fixed = fixed});
  CHECK(s.status == pose_graph_status::converged);
  std::size_t moved = 0;
  for (std::size_t i = 0; i != vertices.size(); ++i) {
    const bool same = test::same_bits({vertices[i]}, {before[i]});
    if (fixed[i] != 0 || i + 1 == vertices.size()) CHECK(same);
    moved += same ? 0 : 1;
  }
  CHECK(moved + 1 + static_cast<std::size_t>(std::accumulate(fixed.begin(), fixed.end(), 0)) == vertices.size());
}

TEST_CASE("Input that cannot be solved is refused with what and where, and left alone") {
  const auto refused = [](std::vector<se3> vertices, const std::vector<edge>& edges, pose_graph_status status,
                          std::size_t where, const pose_graph_options& options = {}) {
    const auto before = vertices;
    const auto s = test::solve_pose_graph(seq, vertices, edges, options, {}, trivial{}, gauss_newton{});
    CHECK(s.status == status);
    CHECK(s.where == where);
    CHECK(is_failure(s.status));
    CHECK(to_string(s).find(std::to_string(where)) != std::string::npos);
    for (std::size_t i = 0; i != before.size(); ++i) CHECK(std::memcmp(&before[i], &vertices[i], sizeof(se3)) == 0);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<se3> vertices(6);
  const auto edges = chain(6);
  const auto with = [&](std::size_t k, auto change) {
    auto changed = edges;
    change(changed[k]);
    return changed;
  };
  auto bad = vertices;
  bad[4] = se3{so3{}, vec3(0, nan, 0)};
  refused(bad, edges, pose_graph_status::bad_vertex, 4);
  refused(vertices, with(2, [](edge& e) { e.to = 6; }), pose_graph_status::missing_vertex, 2);
  refused(vertices, with(3, [](edge& e) { e.to = e.from; }), pose_graph_status::self_edge, 3);
  refused(vertices,
          with(1,
               [&](edge& e) {
                 e.measurement = se3{so3{}, vec3(nan, 0, 0)};
               }),
          pose_graph_status::bad_measurement, 1);
  refused(vertices, with(0, [&](edge& e) { e.information(2, 2) = nan; }), pose_graph_status::bad_information, 0);
  refused(vertices, with(4, [&](edge& e) { e.information(2, 2) = 0; }), pose_graph_status::bad_information, 4);
  refused(vertices, with(4, [&](edge& e) { e.information(0, 1) = 0.5; }), pose_graph_status::bad_information, 4);
  refused(vertices, with(4, [&](edge& e) { e.information(0, 1) = e.information(1, 0) = 1.5; }),
          pose_graph_status::bad_information, 4);
  refused(vertices, with(4, [&](edge& e) { e.information *= -1; }), pose_graph_status::bad_information, 4);
  // Vertices 3 to 5 hang together, but by nothing with the rest.
  auto two_pieces = edges;
  two_pieces.erase(two_pieces.begin() + 2);
  refused(vertices, two_pieces, pose_graph_status::no_gauge, 0);
  const std::vector<std::uint8_t> first{1, 0, 0, 0, 0, 0};
  refused(vertices, two_pieces, pose_graph_status::no_gauge, 3, {.fixed = first});
  refused(vertices, edges, pose_graph_status::no_gauge, 0, {.hold = pose_graph_gauge::as_given});
  // Nothing says how far along x vertex 5 is.
  const auto loose = with(4, [&](edge& e) { e.information(0, 0) = 0; });
  refused(vertices, loose, pose_graph_status::bad_information, 4);
  refused(vertices, loose, pose_graph_status::singular, 5, {.semidefinite_information = true});
}

TEST_CASE("Pieces without a fixed vertex can be held by their first") {
  auto edges = chain(6);
  edges.erase(edges.begin() + 2);
  std::vector<se3> vertices(6);
  const auto s = test::solve_pose_graph(seq, vertices, edges, {.hold = pose_graph_gauge::first_of_each_piece});
  CHECK(s.status == pose_graph_status::converged);
  for (int i = 0; i != 6; ++i)
    CHECK(vertices[static_cast<std::size_t>(i)].translation().x() == Approx(i % 3).margin(1e-9));
}

TEST_CASE("Graphs with nothing to do, and of two vertices") {
  std::vector<se3> vertices(3);
  std::vector<edge> edges;
  CHECK(test::solve_pose_graph(seq, vertices, edges).status == pose_graph_status::nothing_to_do);
  const std::vector<std::uint8_t> all(3, 1);
  edges = chain(3);
  CHECK(test::solve_pose_graph(seq, vertices, edges, {.fixed = all}).status == pose_graph_status::nothing_to_do);
  vertices.clear();
  edges.clear();
  CHECK(test::solve_pose_graph(seq, vertices, edges).status == pose_graph_status::nothing_to_do);
  vertices.resize(2);
  edges = chain(2);
  const auto s = test::solve_pose_graph(seq, vertices, edges);
  CHECK(s.status == pose_graph_status::converged);
  CHECK(vertices[1].translation().x() == Approx(1.0));
  // Solved already: nothing is gained, nothing is lost.
  const auto again = test::solve_pose_graph(seq, vertices, edges);
  CHECK(again.status == pose_graph_status::converged);
  CHECK(again.final_cost <= again.initial_cost);
}

TEST_CASE("The result is never worse than what was given, whenever it is stopped") {
  // From vertices turned at random Gauss-Newton goes uphill.
  random_bits random{364};
  const auto made = test::small_graphs()[2];
  std::vector<se3> start;
  for (std::size_t i = 0; i != made.truth.size(); ++i) start.push_back(test::random_pose(random, 5.0));
  for (const int limit : {0, 1, 2, 5}) {
    std::vector<se3> vertices = start;
    const auto s = test::solve<gauss_newton>(seq, vertices, made.measured.edges, {.max_iterations = limit});
    CHECK(s.final_cost <= s.initial_cost);
    CHECK(cost_of(vertices, made.measured.edges) == Approx(s.final_cost).epsilon(1e-9));
  }
  std::vector<se3> vertices = made.measured.vertices;
  std::size_t calls = 0;
  const auto stop = [&](std::size_t done, std::size_t total) {
    CHECK(done == calls++);
    CHECK(total == 100);
    return done != 2;
  };
  const auto s = test::solve_pose_graph(seq, vertices, made.measured.edges, {.relative_tolerance = 0.0}, stop);
  CHECK(s.status == pose_graph_status::cancelled);
  CHECK(s.iterations == 2);
  CHECK(cost_of(vertices, made.measured.edges) == Approx(s.final_cost).epsilon(1e-9));
  CHECK(s.final_cost < s.initial_cost);
}
