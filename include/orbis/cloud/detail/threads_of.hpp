// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The policy that algorithms are compiled for.
#pragma once

#include <algorithm>
#include <concepts>

#include <orbis/core/execution.hpp>

namespace orbis::cloud::detail {

/// Any policy as the one that algorithms are compiled for: the result is the same for all of them.
template <execution_policy Policy>
[[nodiscard]] parallel_policy threads_of(const Policy& policy) noexcept(noexcept(policy.threads())) {
  if constexpr (std::same_as<Policy, parallel_policy>)
    return policy;
  else
    return {std::max(1U, static_cast<unsigned>(policy.threads()))};
}

}  // namespace orbis::cloud::detail
