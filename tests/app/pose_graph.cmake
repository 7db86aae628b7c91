# SPDX-License-Identifier: BSD-3-Clause
#
# The example pose_graph (-DAPP): graphs of its own, tables, JSON, what it writes, and what it says to
# wrong arguments and damaged files.
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)

macro(fails code message)
  app(${code} ${ARGN})
  if(NOT err MATCHES "^pose_graph: [^\n]*${message}[^\n]*\n$")
    message(FATAL_ERROR "pose_graph ${ARGN}\nsaid\n${err}instead of one line that matches \"${message}\"")
  endif()
  check(NOT EXISTS ${WORK}/no.g2o)
endmacro()

# A square of 4 m, seen from odometry with a closing edge that disagrees by 4 cm: each edge takes its share.
set(information "1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 4e8 0 0 4e8 0 4e8")  # turns cost too much to share in it
set(square "VERTEX_SE3:QUAT 10 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 11 2 1 0 0 0 0 1\n"
           "VERTEX_SE3:QUAT 12 3 3 1 0 0 0 1\nVERTEX_SE3:QUAT 13 1 5 0 0 0 0.1 1\nFIX 10\n")
set(edges "EDGE_SE3:QUAT 10 11 4 0 0 0 0 0 1 ${information}\nEDGE_SE3:QUAT 11 12 0 4 0 0 0 0 1 ${information}\n"
          "EDGE_SE3:QUAT 12 13 -4 0 0 0 0 0 1 ${information}\n")
file(WRITE ${WORK}/square.g2o ${square} ${edges} "EDGE_SE3:QUAT 13 10 0 -4.04 0 0 0 0 1 ${information}\n")

# Usage: 1.
fails(1 "FILE")
fails(1 "--loss" square.g2o --loss least)
fails(1 "--width" square.g2o --loss huber --width 0)
fails(1 "--damping" square.g2o --damping none)
fails(1 "--max-iterations" square.g2o --max-iterations -1)
fails(1 "--nonsense" square.g2o --nonsense)
fails(1 "square.g2o: is an input" square.g2o --output ./square.g2o)
execute_process(COMMAND ${APP} square.g2o --output "" WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result ERROR_VARIABLE err)
check(result EQUAL 1 AND err MATCHES "^pose_graph: --output: must not be empty")
app(0 --help)
check(out MATCHES "--chordal" AND out MATCHES "--loss")

# Input, graphs that cannot be solved, and output that cannot be: 2.
fails(2 "nowhere.g2o: no such file" nowhere.g2o)
file(WRITE ${WORK}/text.g2o ${square} "hello\n")
fails(2 "text.g2o:6: .*hello" text.g2o --output no.g2o)
file(WRITE ${WORK}/cut.g2o ${square} "EDGE_SE3:QUAT 10 11 4 0\n")
fails(2 "cut.g2o:6: .*early" cut.g2o --output no.g2o)
file(WRITE ${WORK}/missing.g2o ${square} "EDGE_SE3:QUAT 10 99 4 0 0 0 0 0 1 ${information}\n")
fails(2 "missing.g2o:6: vertex 99" missing.g2o)
string(REPLACE "1 0 0 0 0 0 1 0" "1 0 0 0 0 0 -1 0" negative "${edges}")
file(WRITE ${WORK}/negative.g2o ${square} ${negative})
fails(2 "negative.g2o: edge 0 .*positive definite" negative.g2o --output no.g2o)
fails(2 "negative.g2o: edge 0 .*positive definite" negative.g2o --chordal --output no.g2o)
fails(2 "no/such/folder" square.g2o --output no/such/folder/graph.g2o)

# chi2 of the best distribution: 0.01 m for each of four edges.
app(0 square.g2o --json)
string(JSON chi2 GET "${out}" chi2)
check(chi2 MATCHES "^0\\.000(4|399999)")
string(JSON status GET "${out}" status)
check(status STREQUAL "converged")
string(JSON vertices GET "${out}" vertices)
check(vertices EQUAL 4)

# The table has a line for the start and one for every iteration.
app(0 square.g2o)
check(out MATCHES "iteration +cost" AND out MATCHES "\n +0 " AND out MATCHES "\n +1 " AND out MATCHES "\nconverged")

# Every way of stepping, chordal start, several threads: the same minimum.
foreach(arguments IN ITEMS "--damping;gauss-newton" "--damping;levenberg-marquardt" "--chordal" "--threads;3")
  app(0 square.g2o --json ${arguments})
  string(JSON chi2 GET "${out}" chi2)
  check(chi2 MATCHES "^0\\.000(4|399999)")
endforeach()

# What is written is the solved graph: nothing is left to do; the fixed vertex is where it was.
app(0 square.g2o --output solved.g2o)
file(READ ${WORK}/solved.g2o text)
check(text MATCHES "^VERTEX_SE3:QUAT 10 0 0 0 0 0 0 1\nFIX 10\nVERTEX_SE3:QUAT 11 ")
must_not_be_half_written(${WORK})
app(0 solved.g2o --json --max-iterations 0)
string(JSON chi2 GET "${out}" chi2)
check(chi2 MATCHES "^0\\.000(4|399999)")

# With a robust loss the odd edge out costs less, and there is no chi2 to be had.
string(REPLACE "-4.04" "-9" odd "EDGE_SE3:QUAT 13 10 0 -4.04 0 0 0 0 1 ${information}\n")
file(WRITE ${WORK}/odd.g2o ${square} ${edges} ${edges} ${odd})
app(0 odd.g2o --json)
string(JSON squares GET "${out}" final_cost)
foreach(loss IN ITEMS huber cauchy tukey)
  app(0 odd.g2o --json --loss ${loss} --width 0.5 --chordal)
  string(JSON cost GET "${out}" final_cost)
  string(JSON type TYPE "${out}" chi2)
  check(cost LESS squares)
  check(type STREQUAL "NULL")
endforeach()

# A cost beyond the numbers of the machine is an error, not JSON with "inf"; so is output that cannot be written.
file(WRITE ${WORK}/large.g2o "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1e200 0 0 0 0 0 1\n"
     "EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 ${information}\n")
app(2 large.g2o --json)
check(NOT out AND err MATCHES "large.g2o: the cost is not finite")
if(EXISTS /dev/full)
  execute_process(COMMAND bash -c "\"${APP}\" square.g2o --json >/dev/full" WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result
                  ERROR_VARIABLE err)
  check(result EQUAL 2 AND err MATCHES "pose_graph: standard output: cannot be written")
endif()

# Short of memory: one line, too.
set(chain "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nFIX 0\n")
foreach(i RANGE 1 3000)
  math(EXPR before "${i} - 1")
  string(APPEND chain "VERTEX_SE3:QUAT ${i} ${i} 1 0 0 0 0 1\nEDGE_SE3:QUAT ${before} ${i} 1 0 0 0 0 0 1 ${information}\n")
endforeach()
file(WRITE ${WORK}/chain.g2o "${chain}")
app_short_of_memory(pose_graph chain.g2o --json)
