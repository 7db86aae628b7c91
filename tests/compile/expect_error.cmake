# SPDX-License-Identifier: BSD-3-Clause
file(STRINGS ${SOURCE} first_line LIMIT_COUNT 1)
if(NOT first_line MATCHES "^// error: (.+)$")
  message(FATAL_ERROR "${SOURCE}: the first line must be `// error: <regular expression>`")
endif()
set(expected "${CMAKE_MATCH_1}")

string(REPLACE "|" ";" include_list "${INCLUDES}")
set(flags)
foreach(directory IN LISTS include_list)
  if(directory)
    list(APPEND flags -I ${directory})
  endif()
endforeach()

execute_process(COMMAND ${COMPILER} -std=c++20 -fsyntax-only ${flags} ${SOURCE}
                RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(status EQUAL 0)
  message(FATAL_ERROR "${SOURCE} compiles, but must not")
endif()
if(NOT output MATCHES "${expected}")
  message(FATAL_ERROR "${SOURCE} is refused, but not with \"${expected}\":\n${output}")
endif()
