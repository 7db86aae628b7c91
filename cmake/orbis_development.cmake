# SPDX-License-Identifier: BSD-3-Clause
#
# Flags for our own tests, benchmarks and examples. Nothing here reaches an includer.
add_library(orbis_development INTERFACE)
target_compile_options(orbis_development INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion
  -ffp-contract=off  # bit-for-bit comparisons with other libraries
  # g++ looks for garbage less often: a tenth of its time for some MB more.
  $<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=400000>
  $<$<BOOL:${ORBIS_WERROR}>:-Werror>)

# The flavour of the library that our programs use: the compiled one where it is built.
add_library(orbis_flavour INTERFACE)
if(TARGET orbis_compiled)
  target_compile_options(orbis_compiled PRIVATE $<TARGET_PROPERTY:orbis_development,INTERFACE_COMPILE_OPTIONS>)
  target_link_libraries(orbis_flavour INTERFACE orbis_compiled)
endif()
