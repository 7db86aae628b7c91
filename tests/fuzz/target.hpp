// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What every fuzz target has: an entry, a way to fail, and the memory a call takes.
///
/// A target is one file here that defines LLVMFuzzerTestOneInput, and a folder corpus/<its name>. The
/// ordinary tests replay the corpus and mutations of it (replay_main.cpp); with clang and
/// ORBIS_BUILD_FUZZERS each is a libFuzzer program as well.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <utility>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace orbis::fuzz {

/// Ends the program, which is how a fuzzer learns of a failure, unless `holds`.
inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %s\n", what);
  std::abort();
}

/// The number of inputs, or parts of them, that were read without an error; `accept` counts one.
inline std::size_t accepted = 0;
inline void accept() { ++accepted; }

/// Bytes that `operator new` has handed out on this thread and not got back, and their maximum since
/// it was last reset (allocations.cpp).
struct allocation_counts {
  std::size_t now = 0;
  std::size_t peak = 0;
};
[[nodiscard]] allocation_counts& allocations() noexcept;

/// The most bytes on the heap at any time while `work` runs on this thread, beyond those before.
template <class Work>
[[nodiscard]] std::size_t peak_bytes_of(Work&& work) {
  allocation_counts& counts = allocations();
  const std::size_t before = counts.peak = counts.now;
  std::forward<Work>(work)();
  return counts.peak - before;
}

}  // namespace orbis::fuzz
