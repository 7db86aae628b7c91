# SPDX-License-Identifier: BSD-3-Clause
#
# rgbd_slam live: a recording that plays as a camera stands for one.
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)

app(0 live --help)
check(out MATCHES "DEVICE" AND out MATCHES "OpenNI2" AND out MATCHES "are dropped")
make_recording(${WORK}/room 40 320)
file(REMOVE ${WORK}/room/groundtruth.txt)

# To its end. What is tracked and what is dropped are all frames of it.
app(0 live room --resolution 0.1 --filter none --out out)
must_exist(${WORK}/out trajectory.txt cloud.ply map.bt summary.json report.html)
check(err MATCHES "room: live camera, 320 x 240")
summary(frames ${WORK}/out frames)
summary(dropped ${WORK}/out dropped)
math(EXPR all "${frames} + ${dropped}")
check(all EQUAL 40)
summary(tracked ${WORK}/out tracked)
check(tracked GREATER 2)

# Recordings do not drop frames.
app(0 run room --frames 3 --resolution 0.1 --filter none --quiet --out recorded)
file(READ ${WORK}/recorded/summary.json text)
string(JSON kind TYPE "${text}" dropped)
check(kind STREQUAL NULL)

# Its files are not written over.
app_fails(1 "room/rgb.txt: is an input of this run" live room --resolution 0.1 --out out --save-map room/rgb.txt)

# After so many frames.
app(0 live room --frames 3 --resolution 0.1 --filter none --quiet --out three)
summary(frames ${WORK}/three frames)
check(frames EQUAL 3)

# The camera is gone in the middle: the results are those up to there.
file(REMOVE_RECURSE ${WORK}/out)
foreach(number RANGE 30 39)
  file(WRITE ${WORK}/room/rgb/0000${number}.png "damaged")
endforeach()
app(2 live room --resolution 0.1 --filter none --out out)
check(err MATCHES "rgbd_slam: [^\n]*000030.png[^\n]*stopped after [0-9]+ frames, whose results are kept\n$")
must_exist(${WORK}/out trajectory.txt cloud.ply map.bt summary.json report.html)

# A folder without depth is one camera's, though nobody says so.
file(COPY ${WORK}/room/rgb/000000.png ${WORK}/room/rgb/000001.png ${WORK}/room/camera.toml DESTINATION ${WORK}/images)
app_fails(3 "tracking never started: no two of" live images --out one)
# Its images alone: two frames are no map.
app_fails(3 "tracking never started" live room --sensor mono --frames 2 --out one)

# Ctrl-C, while a slow camera is waited for.
foreach(list rgb depth)
  set(lines "")
  foreach(i RANGE 0 29)
    string(LENGTH "${i}" digits)
    if(digits EQUAL 1)
      set(zeros 00000)
    else()
      set(zeros 0000)
    endif()
    string(APPEND lines "${i}.5 ${list}/${zeros}${i}.png\n")
  endforeach()
  file(WRITE ${WORK}/room/${list}.txt "${lines}")
endforeach()
execute_process(COMMAND timeout --preserve-status -s INT 4 ${APP} live room --resolution 0.1 --filter none --out stopped
                WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result ERROR_VARIABLE err)
check(result EQUAL 130)
must_exist(${WORK}/stopped trajectory.txt map.bt summary.json report.html)
summary(frames ${WORK}/stopped frames)
check(frames LESS 10)

# The same where a recording comes at its pace.
execute_process(COMMAND timeout --preserve-status -k 8 -s INT 4 ${APP} run room --realtime --resolution 0.1 --filter none --out paced
                WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result ERROR_VARIABLE err)
check(result EQUAL 130)
summary(frames ${WORK}/paced frames)
check(frames LESS 10)

# No device, or no library for it.
app_fails(2 "no depth camera is connected|this build has no support for depth cameras: .*libopenni2-dev" live /no/such/device --out none)
app_fails(2 "unknown camera: specify it with --camera|has no support for video cameras: .*libopencv-videoio-dev"
          live /dev/video99 --sensor stereo --out none)
app_fails(2 "by-id/usb: cannot be opened as a video camera|no support for video cameras"
          live /dev/v4l/by-id/usb --camera kinect --out none)
app_fails(1 "sonar" live --sensor sonar --out none)
check(NOT EXISTS ${WORK}/none)
