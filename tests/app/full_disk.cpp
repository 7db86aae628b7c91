// SPDX-License-Identifier: BSD-3-Clause
//
// Loaded before a program (LD_PRELOAD): whatever it writes at a place in a file fails as on a full disk. The depth
// images that are spilled are written so, results are not.
#include <cerrno>
#include <cstddef>

#include <sys/types.h>

extern "C" ssize_t pwrite(int, const void*, std::size_t, off_t) {
  errno = ENOSPC;
  return -1;
}
extern "C" ssize_t pwrite64(int, const void*, std::size_t, off_t) {
  errno = ENOSPC;
  return -1;
}
