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
app_fails(1 "subcommand")
app_fails(1 "no command \"fly\"" fly)
app_fails(1 "--out" run good)
app_fails(1 "--out" run good --out "")
app_fails(1 "--seed" demo --out out --seed -1)
app_fails(1 "DATASET" run --out out)
app_fails(1 "--nonsense" run good --out out --nonsense)
app_fails(1 "--frames" run good --out out --frames 0)
app_fails(1 "--frames" run good --out out --frames many)
app_fails(1 "--stride" run good --out out --stride -2)
app_fails(1 "--resolution" run good --out out --resolution nan)
app_fails(1 "--resolution" run good --out out --resolution 0)
app_fails(1 "--filter" run good --out out --filter coffee)
app_fails(1 "--threads" run good --out out --threads 0)
app_fails(1 "--format" run good --out out --format raw)
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
app(0 --help)
check(out MATCHES "run" AND out MATCHES "demo" AND out MATCHES "eval" AND out MATCHES "map")
app(0 run --help)
check(out MATCHES "--resolution")

# Input: 2.
file(WRITE ${WORK}/broken.toml "frames = = 3\n")
app_fails(2 "broken.toml:1" run good --out out --config broken.toml)
app_fails(2 "none.toml: no such file" run good --out out --config none.toml)
app_fails(2 "nowhere: no such folder" run nowhere --out out)
file(WRITE ${WORK}/file "text")
app_fails(2 "file: " run file --out out)
file(MAKE_DIRECTORY ${WORK}/nothing)
app_fails(2 "nothing: " run nothing --out out)

recording(no_entries)
file(WRITE ${WORK}/no_entries/rgb.txt "# nothing\n")
app_fails(2 "no_entries/rgb.txt" run no_entries --out out)

recording(no_images)
file(GLOB images ${WORK}/no_images/rgb/*)
file(REMOVE ${images})
app_fails(2 "no_images/rgb" run no_images --out out)

recording(bad_pose)
file(APPEND ${WORK}/bad_pose/groundtruth.txt "9 nan 0 0 0 0 0 1\n")
app_fails(2 "groundtruth.txt:[0-9]+: .*NaN" run bad_pose --out out)

recording(bad_camera)
file(WRITE ${WORK}/bad_camera/camera.toml "model = \"pinhole\"\nwidth = 160\nheight = 120\nfx = -3\n")
app_fails(2 "camera.toml" run bad_camera --out out)
file(WRITE ${WORK}/bad_camera/camera.toml "model = \"pinhole\"\nwidth = 320\nheight = 240\nfx = 200\nfy = 200\ncx = 160\ncy = 120\ndepth_scale = 5000\nfps = 30\n")
app_fails(2 "160x120" run bad_camera --out out)
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

# Clouds.
app_fails(2 "cloud.ply: no such file" map cloud.ply --out out)
file(WRITE ${WORK}/cut.ply "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n")
app_fails(2 "cut.ply: " map cut.ply --out out --quiet)
file(WRITE ${WORK}/empty.ply "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n")
app_fails(2 "empty.ply: .*no finite points" map empty.ply --out out)
app_fails(2 "file: " map file --out out)

# Output that cannot be: 2.
app_fails(2 "file/out" run good --out file/out)
app_fails(2 "file" run good --out file)

# Nothing to see: 3.
make_recording(${WORK}/dark 6 16)
app_fails(3 "dark: tracking never started" run dark --out never_started --quiet)
must_exist(${WORK}/never_started summary.json)
summary(tracked ${WORK}/never_started tracked)
check(tracked EQUAL 0)
