// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A stub of ROS 2: message_filters::sync_policies::ApproximateTime, of three messages.
#pragma once

#include <cstdint>

namespace message_filters::sync_policies {
template <class First, class Second, class Third>
struct ApproximateTime {
  explicit ApproximateTime(std::uint32_t) {}
};
}  // namespace message_filters::sync_policies
