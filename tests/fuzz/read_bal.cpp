// SPDX-License-Identifier: BSD-3-Clause
//
// Any bytes as a file of Bundle Adjustment in the Large; what can be read is written and read again, and
// adjusted.
#include <cmath>
#include <span>
#include <string_view>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/io/bal.hpp>
#include <orbis/optimize/bundle_adjustment-inl.hpp>
#include <orbis/optimize/reprojection_with_intrinsics.hpp>

#include "fuzz/target.hpp"

namespace {

using namespace orbis;

template <class Policy>
optimize::bundle_summary adjust(const Policy& policy, const io::bal_problem& problem, std::vector<vec3>& points) {
  std::vector<optimize::bal_camera> cameras;
  for (const auto& c : problem.cameras) cameras.push_back(optimize::bal_camera::from_parameters(c));
  std::vector<optimize::bundle_observation> observations;
  for (const auto& o : problem.observations) observations.push_back({o.camera, o.point, o.pixel});
  points = problem.points;
  optimize::bundle_adjuster ba{optimize::bal_reprojection{}, optimize::huber{2.0}};
  return ba.solve(policy, std::span{cameras}, std::span{points},
                  std::span<const optimize::bundle_observation>{observations}, {.max_iterations = 4});
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text{reinterpret_cast<const char*>(data), size};
  result<io::bal_problem> problem = fail(errc::no_data, "", "");
  const std::size_t peak = fuzz::peak_bytes_of([&] { problem = io::parse_bal(text, "fuzz.txt"); });
  fuzz::require(peak <= 8 * size + 4096, "memory is in proportion to the file");
  if (!problem) {
    fuzz::require(!problem.error().message.empty(), "an error says why");
    fuzz::require(problem.error().where.starts_with("fuzz.txt:"), "an error says where");
    return 0;
  }
  fuzz::accept();
  for (const io::bal_observation& o : problem->observations) {
    fuzz::require(o.camera < problem->cameras.size() && o.point < problem->points.size(), "indices are in range");
    const auto pixel = io::project_bal(problem->cameras[o.camera], problem->points[o.point]);
    fuzz::require(!pixel || pixel->allFinite(), "a pixel is a number");
  }
  const auto again = io::parse_bal(io::format_bal(*problem));
  fuzz::require(again.has_value(), "what is written can be read");
  fuzz::require(again->cameras == problem->cameras && again->points == problem->points &&
                    again->observations.size() == problem->observations.size(),
                "what is written is read back");

  std::vector<vec3> one, two;
  const auto s = adjust(seq, *problem, one);
  fuzz::require(!(s.final_cost > s.initial_cost), "the cost does not rise");
  fuzz::require(std::isfinite(s.initial_cost) && std::isfinite(s.final_cost), "the cost is a number");
  for (const vec3& p : one) fuzz::require(p.allFinite(), "points stay numbers");
  const auto t = adjust(par.with(2), *problem, two);
  fuzz::require(t.status == s.status && t.final_cost == s.final_cost && one == two, "threads make no difference");
  return 0;
}
