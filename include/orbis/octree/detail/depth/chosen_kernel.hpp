// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A kernel selected at run time, as a member of an object.
#pragma once

#include <orbis/core/simd.hpp>

namespace orbis::octree::detail {

/// Function pointer to a kernel's code, selected when the object is constructed. The kernel is compiled only in
/// translation units that construct objects, not in all that include the class with the member.
template <class Kernel, class Signature, simd::target... Targets>
struct chosen_kernel {
  Signature* run = simd::kernel<Kernel, Signature, Targets...>();

  operator Signature*() const noexcept { return run; }  // converts for calls
};

}  // namespace orbis::octree::detail
