// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as a g2o file; what can be read is written and read again, and solved in every way.
#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/io/g2o.hpp>
#include <orbis/optimize/pose_graph-inl.hpp>

#include "../../examples/pose_graph/chordal.hpp"
#include "fuzz/target.hpp"

namespace {

using namespace orbis;

template <class Damping>
void solve(const io::g2o_graph& graph, const std::vector<se3>& start) {
  const optimize::pose_graph_options options{
      .max_iterations = 4, .fixed = graph.fixed, .semidefinite_information = true};
  std::vector<se3> vertices = start;
  const auto run = [&](const auto& policy, std::vector<se3>& poses) {
    optimize::pose_graph_solver<se3, optimize::huber, Damping> solver{optimize::huber{2.0}};
    return solver.solve(policy, std::span<se3>{poses}, graph.edges, options);
  };
  const auto s = run(seq, vertices);
  fuzz::require(!(s.final_cost > s.initial_cost), "the cost does not rise");
  fuzz::require(s.where < std::max(graph.edges.size(), graph.vertices.size()) || s.where == 0,
                "a failure is somewhere");
  if (!is_failure(s.status) && std::isfinite(s.initial_cost))
    for (const se3& v : vertices) fuzz::require(v.to_matrix().allFinite(), "poses stay numbers");
  std::vector<se3> again = start;
  const auto t = run(par.with(2), again);
  fuzz::require(t.status == s.status && (t.final_cost == s.final_cost || std::isnan(s.final_cost)),
                "threads make no difference");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text{reinterpret_cast<const char*>(data), size};
  result<io::g2o_graph> graph = fail(errc::no_data, "", "");
  const std::size_t peak = fuzz::peak_bytes_of([&] { graph = io::parse_g2o(text, "fuzz.g2o"); });
  fuzz::require(peak <= 64 * size + 8192, "memory is in proportion to the file");
  if (!graph) {
    fuzz::require(!graph.error().message.empty(), "an error says why");
    fuzz::require(graph.error().where.starts_with("fuzz.g2o:"), "an error says where");
    return 0;
  }
  fuzz::accept();
  const auto again = io::parse_g2o(io::format_g2o(*graph));
  fuzz::require(again.has_value(), "what is written can be read");
  fuzz::require(again->ids == graph->ids && again->fixed == graph->fixed && again->edges.size() == graph->edges.size(),
                "what is written is read back");
  solve<optimize::gauss_newton>(*graph, graph->vertices);
  solve<optimize::levenberg_marquardt>(*graph, graph->vertices);
  solve<optimize::dogleg>(*graph, graph->vertices);
  std::vector<se3> start = graph->vertices;
  const auto s = examples::start_chordally(std::span{start}, graph->edges,
                                           {.fixed = graph->fixed, .semidefinite_information = true});
  if (s.status == optimize::pose_graph_status::converged) solve<optimize::dogleg>(*graph, start);
  return 0;
}
