# SPDX-License-Identifier: BSD-3-Clause
#
# Whatever is wrong: one line that names it, the documented exit code, nothing half-written.
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)
make_recording(${WORK}/good 6 160)

# A copy of the good recording, to be spoilt.
function(recording name)
  file(REMOVE_RECURSE ${WORK}/${name})
  file(COPY ${WORK}/good/ DESTINATION ${WORK}/${name})
endfunction()
function(truncate path)
  file(READ ${path} bytes LIMIT 600 HEX)
  string(REGEX REPLACE "(..)" "\\\\x\\1" escaped "${bytes}")
  execute_process(COMMAND bash -c "printf '${escaped}'" OUTPUT_FILE ${path})
endfunction()

# Usage: 1.
app_fails(1 "a command is missing; use run, live")
app_fails(1 "no command \"fly\"" fly)
app_fails(1 "--out" run good)
app_fails(1 "--out" run good --out "")
app_fails(1 "--seed" demo --out out --seed -1)
app_fails(1 "--seed: .* is out of range" demo --out out --seed 18446744073709551616)
app_fails(1 "DATASET" run --out out)
app_fails(1 "unknown option .--nonsense." run good --out out --nonsense)
app_fails(1 "unexpected argument .more." run good more --out out)
file(WRITE ${WORK}/circle/depth.txt "0.0 0.png\n")
file(CREATE_LINK rgb.txt ${WORK}/circle/rgb.txt SYMBOLIC)
app_fails(2 "rgb.txt: cannot be accessed: Too many levels of symbolic links" run circle --out out)
app_fails(1 "--gravity" run good --out out --gravity "")
app_fails(1 "unknown option .--nonsense." run good --nonsense)  # before --out, which is missing, too
app_fails(1 "--frames" run good --out out --frames 0)
app_fails(1 "--frames" run good --out out --frames many)
app_fails(1 "--stride" run good --out out --stride -2)
app_fails(1 "--resolution" run good --out out --resolution nan)
app_fails(1 "--resolution" run good --out out --resolution 0)
app_fails(1 "--filter" run good --out out --filter coffee)
app_fails(1 "--radius" run good --out out --filter radius --radius nan)
app_fails(1 "--neighbors" run good --out out --neighbors 0)
app_fails(1 "--threads" run good --out out --threads 0)
app_fails(1 "--format" run good --out out --format raw)
app_fails(1 "--format kitti is not supported for --sensor rgbd; use tum, 7scenes" run good --out out --sensor rgbd --format kitti)
app_fails(1 "--format images is not supported for --sensor stereo" run good --out out --sensor stereo --format images)
app_fails(1 "--format pairs is not supported for --sensor mono" run good --out out --sensor mono --format pairs)
app_fails(1 "nikon" run good --out out --camera nikon)
app_fails(1 "--origin" map cloud.ply --out out --origin 1,2)
file(WRITE ${WORK}/unknown.toml "colour = 3\n")
app_fails(1 "unknown.toml.*colour" run good --out out --config unknown.toml)
file(WRITE ${WORK}/value.toml "frames = \"many\"\n")
app_fails(1 "value.toml.*frames" run good --out out --config value.toml)
app_fails(2 "nowhere" run nowhere --out out)
check(NOT EXISTS ${WORK}/out)
if(EXISTS /dev/full)
  execute_process(COMMAND bash -c "\"${APP}\" eval good/groundtruth.txt good/groundtruth.txt >/dev/full"
                  WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result ERROR_VARIABLE err)
  check(result EQUAL 2 AND err MATCHES "rgbd_slam: standard output: cannot be written")
endif()
# A pipe that its reader closes does not end a run; long and odd names are quoted in part and in one line.
execute_process(COMMAND bash -c "\"${APP}\" run good --out piped --resolution 0.2 --filter none 2>&1 | head -1"
                WORKING_DIRECTORY ${WORK} OUTPUT_VARIABLE out)
foreach(name trajectory.txt map.bt report.html summary.json)
  check(EXISTS ${WORK}/piped/${name})
endforeach()
file(REMOVE_RECURSE ${WORK}/piped)
# Closed streams: the files of the run do not become standard streams, into which progress is printed.
set(same run good --resolution 0.2 --filter none --deterministic --depth-memory 0)
app(0 ${same} --out open)
execute_process(COMMAND bash -c "exec \"$@\" <&- >&- 2>&-" closed ${APP} ${same} --out shut WORKING_DIRECTORY ${WORK}
                RESULT_VARIABLE result)
check(result EQUAL 2)  # standard output cannot be written
foreach(name cloud.ply map.bt trajectory.txt)
  execute_process(COMMAND ${CMAKE_COMMAND} -E compare_files open/${name} shut/${name} WORKING_DIRECTORY ${WORK}
                  RESULT_VARIABLE differ)
  check(differ EQUAL 0)
endforeach()
file(REMOVE_RECURSE ${WORK}/open ${WORK}/shut)
# Too few descriptors for the results: refused before any frame is tracked.
execute_process(COMMAND bash -c "ulimit -n 8; exec \"$@\"" limited ${APP} ${same} --out few WORKING_DIRECTORY ${WORK}
                RESULT_VARIABLE result ERROR_VARIABLE err)
check(result EQUAL 2)
check(err MATCHES "Too many open files[^\n]*\n$" AND NOT err MATCHES "tracking")
# Files that may not grow, pictures of the map among them: one line, the trajectories, and nothing half-written.
execute_process(COMMAND bash -c "ulimit -f 100; exec \"$@\"" limited ${APP} run good --out out --quiet
                WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result ERROR_VARIABLE err)
check(result EQUAL 2)
check(err MATCHES "^rgbd_slam: out/[a-z_.]+: cannot be written: File too large. the map is missing[^\n]*\n$")
must_exist(${WORK}/out trajectory.txt keyframes.txt camera_used.toml summary.json)
must_not_be_half_written(${WORK}/out)
check(NOT EXISTS ${WORK}/out/map.bt)
file(REMOVE_RECURSE ${WORK}/out)
execute_process(COMMAND bash -c "\"${APP}\" run good --out out --config ''; \"${APP}\" run '' --out out" ERROR_VARIABLE err
                WORKING_DIRECTORY ${WORK})
check(err MATCHES "^rgbd_slam: --config: must not be empty[^\n]*\nrgbd_slam: DATASET: must not be empty[^\n]*\n$")
string(REPEAT "x" 1900 long)
app(2 run ${long} --out out)
string(LENGTH "${err}" length)
check(length LESS 300)
app(1 run good --out out --filter ${long})
string(LENGTH "${err}" length)
check(length LESS 500)
app(0 --help)
check(out MATCHES "run" AND out MATCHES "demo" AND out MATCHES "eval" AND out MATCHES "map")
app(0 run --help)
check(out MATCHES "--resolution")

# Input: 2.
file(WRITE ${WORK}/broken.toml "frames = = 3\n")
file(WRITE ${WORK}/latin.sh "printf 'frames = 5 # gr\\374n\\n' > latin.toml")
execute_process(COMMAND sh latin.sh WORKING_DIRECTORY ${WORK})
app_fails(2 "latin.toml: not TOML: not UTF-8" run good --out out --config latin.toml)
app_fails(2 "broken.toml:1" run good --out out --config broken.toml)
app_fails(2 "none.toml: no such file" run good --out out --config none.toml)
app_fails(2 "nowhere: no such folder" run nowhere --out out)
file(WRITE ${WORK}/results/trajectory.txt "0 0 0 0 0 0 0 1\n")
file(WRITE ${WORK}/results/camera_used.toml "")
file(COPY_FILE ${WORK}/good/rgb/000000.png ${WORK}/results/map.png)
app_fails(2 "results: contains the results of a run, not a recording" run results --out out)
# Results beside the images of one camera: the images are the recording, the pictures of the results are not.
file(COPY ${WORK}/good/rgb/ DESTINATION ${WORK}/results)
app(3 run results --camera good/camera.toml --out numbered)
check(err MATCHES "with other names .map.png. are skipped" AND err MATCHES "no two of the 6 frames")
file(GLOB images ${WORK}/results/0*.png)
file(REMOVE ${images})
app_fails(1 "unexpected argument .-5." run good -5 --out out)
file(WRITE ${WORK}/file "text")
app_fails(2 "file: " run file --out out)
file(MAKE_DIRECTORY ${WORK}/nothing)
app(2 run nothing --out out)
check(err MATCHES "rgbd_slam: nothing: not a known recording")

# A camera of another size than the images is refused before memory of its size is allocated.
recording(large_camera)
file(READ ${WORK}/large_camera/camera.toml camera)
foreach(parameter width height fx fy)
  string(REGEX REPLACE "(^|\n)${parameter} = [^\n]*" "\\1${parameter} = 20000" camera "${camera}")
endforeach()
file(WRITE ${WORK}/large_camera/camera.toml "${camera}")
execute_process(COMMAND bash -c "ulimit -v 500000 && \"${APP}\" --help" RESULT_VARIABLE result OUTPUT_QUIET ERROR_QUIET)
if(result EQUAL 0)
  execute_process(COMMAND bash -c "ulimit -v 500000; exec \"$@\"" limited ${APP} run large_camera --out out
                  WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result ERROR_VARIABLE err)
  check(result EQUAL 2 AND err MATCHES "^rgbd_slam: [^\n]*000000.png: [^\n]*20000x20000[^\n]*\n$")
endif()

# Voxels of which one frame would fill the memory are refused before they do.
make_recording(${WORK}/sharp 2 640)
foreach(command run map)
  app_fails(2 "--resolution: the first frame alone has about .* voxels of 1 mm .* too many"
            ${command} sharp --out out --resolution 0.001)
endforeach()
make_recording(${WORK}/sharp_later 4 640 - 0 1)
app_fails(2 "--resolution: frame 2 alone has about .* voxels of 1 mm .* too many" run sharp_later --out out --resolution 0.001)
app_fails(2 "--resolution: .* voxels of 1 mm" demo --plain --frames 2 --out out --resolution 0.001)
check(NOT EXISTS ${WORK}/out/summary.json)

recording(no_entries)
file(WRITE ${WORK}/no_entries/rgb.txt "# nothing\n")
app_fails(2 "no_entries/rgb.txt" run no_entries --out out)

recording(no_images)
file(GLOB images ${WORK}/no_images/rgb/*)
file(REMOVE ${images})
app_fails(2 "no_images/rgb" run no_images --out out)

recording(bad_pose)
file(APPEND ${WORK}/bad_pose/groundtruth.txt "9 nan 0 0 0 0 0 1\n")  # a lost pose
app(0 map bad_pose --out lost --resolution 0.2)
check(err MATCHES "warning: [^\n]*groundtruth.txt: 1 poses with NaN, infinity or a zero quaternion are left out")
file(APPEND ${WORK}/bad_pose/groundtruth.txt "10 zero 0 0 0 0 0 1\n")
app_fails(2 "groundtruth.txt:[0-9]+: .*zero" run bad_pose --out out)

# A truth so far away that the steps of a plot's axis are lost in rounding: the pictures come to an end.
recording(far_truth)
file(STRINGS ${WORK}/far_truth/groundtruth.txt poses REGEX "^[^#]")
set(far "")
set(i 0)
foreach(pose IN LISTS poses)
  string(REGEX REPLACE "^([^ ]+) .*$" "\\1 1e18 ${i}e17 0 0 0 0 1" pose "${pose}")
  string(APPEND far "${pose}\n")
  math(EXPR i "${i} + 1")
endforeach()
file(WRITE ${WORK}/far_truth/groundtruth.txt "${far}")
app(0 run far_truth --out far --resolution 0.1)
must_exist(${WORK}/far trajectory.png map.png report.html)

recording(bad_camera)
file(WRITE ${WORK}/bad_camera/camera.toml "model = \"pinhole\"\nwidth = 160\nheight = 120\nfx = -3\n")
app_fails(2 "camera.toml" run bad_camera --out out)
file(WRITE ${WORK}/bad_camera/camera.toml "model = \"pinhole\"\nwidth = 320\nheight = 240\nfx = 200\nfy = 200\ncx = 160\ncy = 120\ndepth_scale = 5000\nfps = 30\n")
app_fails(2 "160x120" run bad_camera --out out)
file(WRITE ${WORK}/bad_camera/camera.toml "model = \"pinhole\"\nwidth = 160\nheight = 120\nfx = 130\nfy = 130\ncx = 80\ncy = 60\ndepth_skale = 5000\n")
app_fails(2 "camera.toml: depth_skale is not a camera setting" run bad_camera --out out)
file(REMOVE ${WORK}/bad_camera/camera.toml)
app_fails(2 "camera" run bad_camera --out out)
app_fails(2 "none.toml" run good --out out --camera none.toml)

recording(damaged_first)
truncate(${WORK}/damaged_first/rgb/000000.png)
app_fails(2 "rgb/000000.png: .*PNG" run damaged_first --out out)
recording(no_depth_image)
file(WRITE ${WORK}/no_depth_image/depth/000000.png "this is no picture")
app_fails(2 "depth/000000.png" run no_depth_image --out out)
file(GLOB left ${WORK}/out/*)
check(NOT left)

# In the middle: what was reached is kept, and the page says so.
make_recording(${WORK}/damaged 12 320)
truncate(${WORK}/damaged/depth/000008.png)
app_fails(2 "depth/000008.png: .*8 of 12" run damaged --out partial --quiet --resolution 0.1)
must_exist(${WORK}/partial trajectory.txt cloud.ply map.bt summary.json report.html)
must_not_be_half_written(${WORK}/partial)
summary(frames ${WORK}/partial frames)
check(frames EQUAL 8)

# Before anything could be tracked: what is wrong is the image, not that tracking never started.
make_recording(${WORK}/dark_and_damaged 6 16)
file(WRITE ${WORK}/dark_and_damaged/depth/000003.png "this is no picture")
app_fails(2 "depth/000003.png: .*stopped after 3 of 6 frames, none of which could be tracked" run dark_and_damaged --out dark --quiet)
summary(frames ${WORK}/dark frames)
check(frames EQUAL 3)

# What only some recordings have.
app_fails(2 "--topics: needs a ROS bag, but good is not a bag" run good --out out --topics /a,/b)
app_fails(2 "--truth-topic: needs a ROS bag, but good is not a bag" run good --out out --truth-topic /a)
app_fails(2 "good: a monocular recording cannot produce a map" map good --out out --sensor mono)
foreach(sequence seq-01 seq-02)
  file(COPY_FILE ${WORK}/good/rgb/000000.png ${WORK}/${sequence}.png)
  file(COPY ${WORK}/${sequence}.png DESTINATION ${WORK}/scene/${sequence})
  file(RENAME ${WORK}/scene/${sequence}/${sequence}.png ${WORK}/scene/${sequence}/frame-000000.color.png)
endforeach()
app_fails(2 "scene: holds 2 sequences: specify one of them, for example seq-01" run scene --out out)
check(NOT err MATCHES "--camera")

# Clouds.
app_fails(2 "cloud.ply: no such file" map cloud.ply --out out)
file(WRITE ${WORK}/cut.ply "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n")
app_fails(2 "cut.ply: " map cut.ply --out out --quiet)
file(WRITE ${WORK}/empty.ply "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n")
app_fails(2 "empty.ply: .*no finite points" map empty.ply --out out)
app_fails(2 "file: " map file --out out)
app_fails(2 "cut.ply: the ray-evidence filter needs a recording" map cut.ply --out out --filter ray-evidence)

# Output that cannot be: 2.
app_fails(2 "file/out" run good --out file/out)
check(NOT err MATCHES "\nshutter")  # before the first seconds are looked at
app_fails(2 "file" run good --out file)

# Nothing to see: 3.
make_recording(${WORK}/dark 6 16)
app_fails(3 "dark: tracking never started" run dark --out never_started --quiet)
must_exist(${WORK}/never_started summary.json)
summary(tracked ${WORK}/never_started tracked)
check(tracked EQUAL 0)
