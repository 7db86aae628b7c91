# SPDX-License-Identifier: BSD-3-Clause
#
# The viewer beside a run: it changes no result, and what cannot be shown is said before any work.
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)

app_fails(1 "--viewer.*television" demo --out out --viewer television)
app_fails(1 "--viewer-port" demo --out out --viewer web --viewer-port 65536)
app_fails(1 "--viewer-port" demo --out out --viewer web --viewer-port many)
app_fails(1 "--viewer-hold needs --viewer" demo --out out --viewer-hold)
app_fails(1 "--viewer" map cloud.ply --out out --viewer)
app(0 demo --help)
check(out MATCHES "--viewer-port")

# A window: without the library for it, or without a display.
set(ENV{DISPLAY})
set(ENV{WAYLAND_DISPLAY})
if(HAS_WINDOW)
  app_fails(1 "--viewer window: no window can be opened" demo --out out --frames 2 --width 160 --quiet --viewer)
else()
  app_fails(1 "--viewer window: this program was built without it" demo --out out --viewer)
  app_fails(1 "--viewer window: .*libglfw3-dev" demo --out out --viewer window)
endif()
check(NOT EXISTS ${WORK}/out)
if(NOT HAS_WEB)
  app_fails(1 "--viewer web: this program was built without it.*ORBIS_VIEWER=ON" demo --out out --viewer web)
  return()
endif()

# The same bytes with it.
set(common demo --plain --width 320 --resolution 0.1 --deterministic)
app(0 ${common} --frames 20 --out plain --quiet)
app(0 ${common} --frames 20 --out shown --viewer web --viewer-port 0)
check(err MATCHES "http://127.0.0.1:[0-9]+/")
file(GLOB names RELATIVE ${WORK}/plain ${WORK}/plain/*)
list(REMOVE_ITEM names summary.json report.html)  # which say how long things took
list(LENGTH names count)
check(count GREATER 6)
foreach(name IN LISTS names)
  must_equal(plain/${name} shown/${name})
endforeach()
app(0 ${common} --frames 4 --out batch --batch-map --viewer web --viewer-port 0 --quiet)

# A port that is taken.
file(WRITE ${WORK}/viewer.toml "viewer = \"web\"\nviewer-port = 0\nviewer-hold = true\n")
execute_process(COMMAND bash -c "
  set -e
  : >held.log  # there before it is read
  '${APP}' demo --plain --frames 3 --width 160 --out held --config viewer.toml 2>held.log &
  run=$!
  trap 'kill -9 $run 2>/dev/null || true' EXIT
  for i in $(seq 600); do
    port=$(sed -n 's,.*http://127.0.0.1:\\([0-9]*\\)/.*,\\1,p' held.log)
    [ -n \"$port\" ] && [ -e held/report.html ] && break
    sleep 0.1
  done
  '${APP}' demo --plain --frames 3 --width 160 --out other --viewer web --viewer-port $port 2>taken.log && exit 3 || [ $? = 1 ]
  kill -0 $run      # it is held open ...
  kill -INT $run    # ... until Ctrl-C, which ends it well
  wait $run"
  WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result ERROR_VARIABLE err)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "a held viewer: ${result} ${err}")
endif()
file(READ ${WORK}/held.log err)
check(err MATCHES "viewer +open until Ctrl-C")
file(READ ${WORK}/taken.log err)
check(err MATCHES "127.0.0.1:[0-9]+: .*--viewer-port")
check(NOT EXISTS ${WORK}/other)
must_exist(${WORK}/held summary.json report.html map.bt)

# Threads for the run, or for the viewer: the viewer gives way.
set(program ${APP})
set(limited demo --plain --frames 20 --width 160 --resolution 0.1 --viewer web --viewer-port 0)
foreach(most 2 3 4 5 6 7 8)
  set(APP ${CMAKE_COMMAND} -E env MOST_THREADS=${most} LD_PRELOAD=${NO_THREADS} ASAN_OPTIONS=verify_asan_link_order=0
      ${program})
  if(most LESS 5)  # too few for the run: signals, three threads of SLAM, the live map
    app(2 ${limited} --out limited)
    check(err MATCHES "rgbd_slam: [^\n]*\n$")
    continue()
  endif()
  app(0 ${limited} --out limited)
  must_exist(${WORK}/limited trajectory.txt summary.json report.html map.bt)
  string(REPLACE ";" "," err "${err}")
  string(REGEX MATCHALL "warning: [^\n]*viewer" warnings "${err}")
  list(LENGTH warnings count)
  if(most LESS 8)
    check(count EQUAL 1)
  else()
    check(count EQUAL 0)
  endif()
endforeach()
set(APP ${program})
