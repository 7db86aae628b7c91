# SPDX-License-Identifier: BSD-3-Clause
#
# Signals during each stage, and too little memory for a map: the run ends soon, and nothing that was reached is lost.
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)

# Starts a run, and sends it the signal a while after its log matches `pattern`. Sets `code`, its exit code, `seconds`
# from the signal to its end, and `err`. `environment`: variables of the run. `before_signal`: shell commands that run
# before the signal.
function(interrupt signal pattern delay)  # arguments of the run
  execute_process(COMMAND bash -c "
    : >run.log  # there before it is read
    ${environment} '${APP}' \"$@\" 2>run.log &
    run=$!
    trap 'kill -9 $run 2>/dev/null || true' EXIT
    for i in $(seq 6000); do
      grep -q '${pattern}' run.log && break
      kill -0 $run 2>/dev/null || break
      sleep 0.01
    done
    sleep ${delay}
    ${before_signal}
    start=$(date +%s%N)
    kill -${signal} $run
    wait $run
    code=$?
    trap - EXIT
    echo \"$code;$((($(date +%s%N) - start) / 1000000000))\"" run ${ARGN}
    WORKING_DIRECTORY ${WORK} OUTPUT_VARIABLE ended OUTPUT_STRIP_TRAILING_WHITESPACE)
  list(POP_BACK ended last)
  list(POP_BACK ended first)
  string(REGEX REPLACE ".*\n" "" first "${first}")
  file(READ ${WORK}/run.log log)
  message(STATUS "${signal} at ${pattern}: exit code ${first} after ${last} s")
  set(code ${first} PARENT_SCOPE)
  set(seconds ${last} PARENT_SCOPE)
  set(err "${log}" PARENT_SCOPE)
endfunction()

# The map alone takes far longer than the time limits here.
make_recording(${WORK}/room 30 320)
set(fine run room --resolution 0.004 --filter none)

foreach(signal TERM INT)
  interrupt(${signal} "^tracking  .*keyframes" 0.3 ${fine} --batch-map --out ${signal}
            --floor-map floor_${signal}/floor.yaml)
  check(code EQUAL 130)
  check(seconds LESS 5)
  check(err MATCHES "the map is abandoned")
  check(err MATCHES "the map is missing, the other results were written")
  must_exist(${WORK}/${signal} trajectory.txt keyframes.txt camera_used.toml summary.json report.html)
  must_not_be_half_written(${WORK}/${signal})
  check(NOT EXISTS ${WORK}/${signal}/map.bt)
  file(GLOB floor LIST_DIRECTORIES true ${WORK}/floor_${signal}/* ${WORK}/floor_${signal}/.*)
  check(NOT floor)
  summary(tracked ${WORK}/${signal} tracked)
  check(tracked EQUAL 30)
endforeach()

# The map is given up in a stage that does not end soon, and then the report cannot be written: the trajectories are
# kept.
set(before_signal "(cd no_report/.rgbd_slam-* && mkdir report.html)")
interrupt(INT "^mapping  .*leaves" 0.1 ${fine} --batch-map --out no_report)
set(before_signal "")
check(code EQUAL 2)
check(seconds LESS 5)
check(err MATCHES "rgbd_slam: [^\n]*report.html[^\n]*\n$")
must_exist(${WORK}/no_report trajectory.txt keyframes.txt camera_used.toml summary.json)
must_not_be_half_written(${WORK}/no_report)

# A full disk for the depth images of keyframes.
set(environment "LD_PRELOAD='${FULL_DISK}' ASAN_OPTIONS=verify_asan_link_order=0")
interrupt(INT "^tracking  .*keyframes" 0.3 ${fine} --batch-map --depth-memory 0 --out full)
set(environment "")
check(code EQUAL 130)
check(seconds LESS 5)
check(err MATCHES "the map is abandoned")
must_exist(${WORK}/full trajectory.txt summary.json report.html)
must_not_be_half_written(${WORK}/full)

# While frames are tracked, SIGTERM ends the reading, and leaves the map a few seconds. The live map is far behind.
interrupt(TERM "^tracking  .*fps" 0 demo --plain --frames 100000 --width 320 --resolution 0.004 --filter none --out live)
check(code EQUAL 130)
check(seconds LESS 12)
must_exist(${WORK}/live trajectory.txt summary.json report.html)
must_not_be_half_written(${WORK}/live)

# Nobody reads the messages, and the pipe is full: the second signal still ends the run. (sleep has outputs of its own, or
# this test would wait for its end.)
execute_process(COMMAND bash -c "
  ( head -c 65236 /dev/zero >&2; exec '${APP}' run room --out unread --resolution 0.1 ) 2> >(exec sleep 30 >/dev/null 2>&1) >/dev/null &
  run=$!
  for i in $(seq 500); do ls -A unread 2>/dev/null | grep -q rgbd_slam && break; sleep 0.02; done
  sleep 1
  kill -INT $run; sleep 0.3; kill -INT $run
  for i in $(seq 100); do kill -0 $run 2>/dev/null || exit 0; sleep 0.1; done
  kill -9 $run
  exit 1" WORKING_DIRECTORY ${WORK} RESULT_VARIABLE code OUTPUT_QUIET ERROR_QUIET)
check(code EQUAL 0)
file(GLOB hidden ${WORK}/unread/.rgbd_slam-*)
check(NOT hidden)

# Too little memory for the map.
execute_process(COMMAND bash -c "ulimit -v 200000 && \"${APP}\" --help" RESULT_VARIABLE result OUTPUT_QUIET ERROR_QUIET)
if(result EQUAL 0)
  foreach(how "" --batch-map)
    execute_process(COMMAND bash -c "ulimit -v 500000; exec \"$@\"" limited ${APP} ${fine} ${how} --out small${how}
                    WORKING_DIRECTORY ${WORK} RESULT_VARIABLE code OUTPUT_QUIET ERROR_VARIABLE err)
    check(code EQUAL 2)
    check(err MATCHES "rgbd_slam: small[^\n]*: out of memory[^\n]*the map is missing[^\n]*\n$")
    must_exist(${WORK}/small${how} trajectory.txt summary.json report.html)
    must_not_be_half_written(${WORK}/small${how})
    check(NOT EXISTS ${WORK}/small${how}/map.bt)
  endforeach()
  # Too little for the report with its pictures; OpenCV, which draws their lines and texts, reports that in its own way.
  foreach(limit RANGE 72000 128000 8000)
    execute_process(COMMAND bash -c "ulimit -v ${limit} && \"${APP}\" --help" RESULT_VARIABLE result OUTPUT_QUIET ERROR_QUIET)
    if(NOT result EQUAL 0)  # the libraries do not fit
      continue()
    endif()
    execute_process(COMMAND bash -c "ulimit -v ${limit}; exec \"$@\"" limited ${APP} run room --frames 4 --quiet
                            --deterministic --threads 2 --out tight_${limit}
                    WORKING_DIRECTORY ${WORK} RESULT_VARIABLE code OUTPUT_QUIET ERROR_VARIABLE err)
    check(NOT err MATCHES "OpenCV")
    if(NOT code EQUAL 0)
      check(code EQUAL 2 AND err MATCHES "^rgbd_slam: [^\n]+\n$")
    endif()
    if(err MATCHES "the map is missing")
      must_exist(${WORK}/tight_${limit} trajectory.txt)
    endif()
  endforeach()
endif()
