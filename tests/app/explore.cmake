# SPDX-License-Identifier: BSD-3-Clause
#
# The example explore (-DAPP): it ends by itself with nearly all of the building known, twice the same, and within a
# budget of views.
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)

set(small --resolution 0.15 --width 60 --range 5 --robot-radius 0.2)
app(0 map.bt ${small})
check(EXISTS ${WORK}/map.bt)
if(NOT out MATCHES "^views: ([0-9]+)\npath: ([0-9]+)\\.[0-9]+ m\ncoverage: ([0-9]+)\\.[0-9]+ % of [0-9.]+ m3\n")
  message(FATAL_ERROR "printed\n${out}")
endif()
check(CMAKE_MATCH_1 LESS 600)
check(CMAKE_MATCH_2 GREATER 15)  # it was in all three rooms
check(CMAKE_MATCH_3 EQUAL 100)
check(out MATCHES "\nended: no view shows enough unknown space\n$")

foreach(name IN ITEMS one.bt two.bt)
  app(0 ${name} ${small} --views 40)
  check(out MATCHES "^views: 40\n")
  check(out MATCHES "\nended: maximum number of views\n$")
  list(APPEND said "${out}")
  file(SHA256 ${WORK}/${name} hash)
  list(APPEND hashes ${hash})
endforeach()
list(REMOVE_DUPLICATES said)
list(REMOVE_DUPLICATES hashes)
list(LENGTH said different)
check(different EQUAL 1)
list(LENGTH hashes different)
check(different EQUAL 1)

app(1 map.bt --resolution 7)
check(err MATCHES "^explore: .*--resolution")
app(1)
app(2 no/such/folder/map.bt ${small} --views 16)
check(err MATCHES "^explore: .*no/such/folder")
