// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A kernel as a member of an object.
#pragma once

#include <orbis/core/simd.hpp>

namespace orbis::octree::detail {

/// The code of a kernel, chosen when the object is made. It is compiled by those alone who make objects, not by all who
/// include the class that has the member.
template <class Kernel, class Signature, simd::target... Targets>
struct chosen_kernel {
  Signature* run = simd::kernel<Kernel, Signature, Targets...>();

  operator Signature*() const noexcept { return run; }  // NOLINT(google-explicit-constructor): it is called as one
};

}  // namespace orbis::octree::detail
