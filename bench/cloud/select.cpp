// SPDX-License-Identifier: BSD-3-Clause
//
// The automatic choice of a filter.
#include <cstddef>
#include <functional>
#include <string>

#include <orbis/cloud/select.hpp>
#include <orbis/core/execution.hpp>

#include "cloud/peers.hpp"

namespace orbis::bench {
namespace {

void add_select(std::size_t n) {
  const auto add = [&](const std::string& row, const std::function<cloud::filter_evidence(const points&)>& choose) {
    add_cloud_row<cloud::filter_evidence>(
        "select_filter/n:" + std::to_string(n) + "/" + row, [n]() -> const points& { return room_cloud(n); }, choose,
        [](const points& in, const auto& evidence) { return evidence == cloud::select_filter(seq, in).evidence; });
  };
  add("orbis", [](const points& in) { return cloud::select_filter(seq, in).evidence; });
  add("orbis_par2", [](const points& in) { return cloud::select_filter(par.with(2), in).evidence; });
}

[[maybe_unused]] const bool registered = [] {
  for (const std::size_t n : {10'000U, 300'000U}) add_select(n);
  return true;
}();

}  // namespace
}  // namespace orbis::bench
