# SPDX-License-Identifier: BSD-3-Clause
#
# The example bundle_adjust (-DAPP): generated problems (-DMAKE_BAL), tables, JSON, what it writes, and
# what it says to wrong arguments and damaged files.
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)

macro(fails code message)
  app(${code} ${ARGN})
  if(NOT err MATCHES "^bundle_adjust: [^\n]*${message}[^\n]*\n$")
    message(FATAL_ERROR "bundle_adjust ${ARGN}\nsaid\n${err}instead of one line that matches \"${message}\"")
  endif()
  check(NOT EXISTS ${WORK}/no.txt)
endmacro()

function(make_bal)  # file, cameras, points, sigma, outliers
  execute_process(COMMAND ${MAKE_BAL} ${ARGN} WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "no problem: ${result}")
  endif()
endfunction()

macro(get variable)  # keys...
  string(JSON ${variable} GET "${out}" ${ARGN})
endmacro()

make_bal(noisy.txt 12 300 0.5 0)

# Usage: 1.
fails(1 "FILE")
fails(1 "--loss" noisy.txt --loss least)
fails(1 "--width" noisy.txt --loss huber --width 0)
fails(1 "--damping" noisy.txt --damping none)
fails(1 "--solver" noisy.txt --solver none)
fails(1 "--tolerance" noisy.txt --tolerance -1)
fails(1 "--max-iterations" noisy.txt --max-iterations -1)
fails(1 "--nonsense" noisy.txt --nonsense)
fails(1 "--tolerance: .nan. is not a number" noisy.txt --tolerance nan)
fails(1 "noisy.txt: is an input" noisy.txt --out ./noisy.txt)
app(0 --help)
check(out MATCHES "--solver" AND out MATCHES "--loss")

# Input that cannot be read and output that cannot be written: 2.
fails(2 "nowhere.txt: no such file" nowhere.txt)
file(WRITE ${WORK}/words.txt "hello\n")
fails(2 "words.txt:1: .*hello" words.txt --out no.txt)
file(READ ${WORK}/noisy.txt text)
string(LENGTH "${text}" length)
math(EXPR length "${length} / 2")
string(SUBSTRING "${text}" 0 ${length} half)
file(WRITE ${WORK}/half.txt "${half}")
fails(2 "half.txt:" half.txt --out no.txt)
file(WRITE ${WORK}/range.txt "1 1 1\n1 0 2 3\n0 0 0 0 0 0 1 0 0\n1 1 1\n")
fails(2 "range.txt:2: observation 0 refers to the nonexistent camera 1" range.txt --out no.txt)
fails(2 "no/such/folder" noisy.txt --out no/such/folder/problem.txt)

# Less than the half pixel of noise in each coordinate is what is left: the parameters take their share.
app(0 noisy.txt --json)
get(status status)
get(cameras cameras)
get(points points)
get(observations observations)
get(initial initial_cost)
get(cost final_cost)
get(rms rms_pixels)
check(status STREQUAL "converged" AND cameras EQUAL 12 AND points EQUAL 300)
check(initial GREATER 10000)
check(rms MATCHES "^0\\.[3456]")
math(EXPR per_mille "${observations} * 250 / 1000")  # sigma^2 times the number of observations
check(cost LESS per_mille)

# The table has a line for the start and one for every iteration.
app(0 noisy.txt)
check(out MATCHES "iteration +cost" AND out MATCHES "\n +0 " AND out MATCHES "\n +1 " AND out MATCHES "\nconverged")

# Every way of stepping and solving, several threads: the same minimum, to the digits that are shown.
string(SUBSTRING "${cost}" 0 6 digits)
foreach(arguments IN ITEMS "--damping;dogleg" "--solver;dense" "--solver;sparse" "--solver;iterative" "--threads;3")
  app(0 noisy.txt --json --tolerance 1e-10 ${arguments})
  get(other final_cost)
  string(SUBSTRING "${other}" 0 6 other)
  check(other STREQUAL digits)
endforeach()

# What is written is the adjusted problem: nothing is left to do.
app(0 noisy.txt --out adjusted.txt)
must_not_be_half_written(${WORK})
app(0 adjusted.txt --json --max-iterations 0)
get(initial initial_cost)
string(SUBSTRING "${initial}" 0 6 other)
check(other STREQUAL digits)

# A robust loss finds the minimum that is there without the outliers, and rms makes no sense then.
make_bal(outliers.txt 12 300 0.5 0.05)
foreach(loss IN ITEMS huber cauchy tukey)
  app(0 outliers.txt --json --loss ${loss} --width 2 --out ${loss}.txt)
  string(JSON type TYPE "${out}" rms_pixels)
  check(type STREQUAL "NULL")
  get(cost final_cost)
  get(initial initial_cost)
  check(cost LESS initial)
endforeach()

# Nothing to do is no failure.
file(WRITE ${WORK}/empty.txt "0 0 0\n")
app(0 empty.txt --json)
get(status status)
check(status STREQUAL "nothing to do")

# Short of memory: one line, too.
make_bal(larger.txt 20 3000 0.5 0)
app_short_of_memory(bundle_adjust larger.txt --json)
