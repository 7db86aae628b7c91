// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where the real recordings lie. A test that needs one is skipped, visibly, where it is absent.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

namespace orbis::test {

/// The folder of real recordings: the environment's ORBIS_DATA_DIR, or the one the build was given.
inline std::filesystem::path data_dir() {
  const char* set = std::getenv("ORBIS_DATA_DIR");
  return set != nullptr && *set != '\0' ? set : ORBIS_DATA_DIR;
}

/// Whether `relative` is there; says so, in the words that make ctest count a skip, if it is not.
inline bool have_data(const std::string& relative) {
  const auto path = data_dir() / relative;
  if (std::filesystem::exists(path)) return true;
  std::printf("[skipped] no %s\n", path.string().c_str());
  return false;
}

}  // namespace orbis::test

/// Leaves the test case, counted as skipped, where the real recording is not at hand.
#define ORBIS_NEEDS_DATA(relative) \
  if (!orbis::test::have_data(relative)) return
