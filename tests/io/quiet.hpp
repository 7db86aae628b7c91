// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Catches what is printed to stderr, to show that nothing is.
#pragma once

#include <cstdio>
#include <filesystem>

#include <fcntl.h>
#include <unistd.h>

namespace orbis::test {

/// The bytes that `f()` prints to stderr, by whatever way.
template <class F>
std::size_t bytes_on_stderr(const std::filesystem::path& scratch, F&& f) {
  std::fflush(stderr);
  const int before = dup(STDERR_FILENO);
  const int file = open(scratch.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
  dup2(file, STDERR_FILENO);
  f();
  std::fflush(stderr);
  dup2(before, STDERR_FILENO);
  close(before);
  close(file);
  return static_cast<std::size_t>(std::filesystem::file_size(scratch));
}

}  // namespace orbis::test
