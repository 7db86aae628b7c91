# SPDX-License-Identifier: BSD-3-Clause
#
# Flags for the tests, benchmarks and examples of orbis; they do not propagate to users.
add_library(orbis_development INTERFACE)
target_compile_options(orbis_development INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion
  -ffp-contract=off  # bit-for-bit comparisons with other libraries
  # Less frequent garbage collection in g++: saves a tenth of the time for some MB.
  $<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=400000>
  $<$<BOOL:${ORBIS_WERROR}>:-Werror>)

# The variant of the library for these programs: the compiled one if it is built.
add_library(orbis_flavour INTERFACE)
if(TARGET orbis_compiled)
  # The tests run the library far longer than it takes to compile it: the preset optimises it more than their own code.
  target_compile_options(orbis_compiled PRIVATE $<TARGET_PROPERTY:orbis_development,INTERFACE_COMPILE_OPTIONS>
                                                ${ORBIS_COMPILED_OPTIONS})
  target_link_libraries(orbis_flavour INTERFACE orbis_compiled)
endif()
