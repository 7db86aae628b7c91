# SPDX-License-Identifier: BSD-3-Clause
#
# Flags for our own tests, benchmarks and examples. Nothing here reaches an includer.
add_library(orbis_development INTERFACE)
target_compile_options(orbis_development INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion
  -ffp-contract=off  # bit-for-bit comparisons with other libraries
  $<$<BOOL:${ORBIS_WERROR}>:-Werror>)
