# SPDX-License-Identifier: BSD-3-Clause
#
# Recordings as exporters write them: nothing is guessed or passed over without a word.
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)
set(quick --resolution 0.2 --filter none --frames 3)
make_recording(${WORK}/room 6 160)
function(recording name color depth)  # images of the room by their names, with camera.toml
  file(REMOVE_RECURSE ${WORK}/${name})
  file(COPY ${WORK}/room/rgb/ DESTINATION ${WORK}/${name}/${color})
  file(COPY ${WORK}/room/depth/ DESTINATION ${WORK}/${name}/${depth})
  file(COPY ${WORK}/room/camera.toml DESTINATION ${WORK}/${name})
endfunction()

# Colour and depth by their names, with a camera.
foreach(folders "rgb;depth" "color;aligned_depth" "image;depth_registered")
  recording(r ${folders})
  app(0 run r --out out ${quick})
  list(JOIN folders "/ and " names)
  check(err MATCHES "images from ${names}/" AND err MATCHES "tracking +3 of 3 frames" AND NOT err MATCHES "is not used")
endforeach()

# Without camera.toml: the camera of another program's file, which is named; or a question.
recording(r rgb depth)
file(READ ${WORK}/r/camera.toml camera)
file(REMOVE ${WORK}/r/camera.toml)
app_fails(2 "the camera is not known.*--camera, which takes a file" run r --quiet --out out ${quick})
foreach(name fx depth_scale)
  string(REGEX MATCH "${name} = ([0-9.]+)" ignored "${camera}")
  set(${name} ${CMAKE_MATCH_1})
endforeach()
file(WRITE ${WORK}/r/cam_K.txt "${fx} 0 79.5\n0 ${fx} 59.5\n0 0 1\n")
execute_process(COMMAND ${APP} run r --out out ${quick} WORKING_DIRECTORY ${WORK} ERROR_VARIABLE err)
check(err MATCHES "the camera is read from cam_K.txt, pinhole: 160 x 120, fx ${fx}[^\n]*depth_scale 1000 .millimetres are assumed")
file(WRITE ${WORK}/r/intrinsic.json "{\"width\": 160, \"height\": 120, \"depth_scale\": ${depth_scale},"
     "\"intrinsic_matrix\": [${fx}, 0, 0, 0, ${fx}, 0, 79.5, 59.5, 1]}")
app(0 run r --out out ${quick})
check(err MATCHES "the camera is read from intrinsic.json, pinhole: 160 x 120, fx ${fx}[^\n]*depth_scale ${depth_scale}")
app_fails(1 "intrinsic.json: is an input" run r --quiet --out out ${quick} --save-map r/intrinsic.json)

# Numbered images are no data set: the camera of ICL-NUIM is its own.
file(WRITE ${WORK}/r/associations.txt "0 depth/000000.png 0 rgb/000000.png\n1 depth/000001.png 1 rgb/000001.png\n")
file(REMOVE ${WORK}/r/cam_K.txt ${WORK}/r/intrinsic.json)
app_fails(2 "the camera is not known" run r --quiet --out out ${quick})

# A folder of depth that is not one of the known names.
recording(r color depth_raw)
app(3 run r --out out ${quick})
check(err MATCHES "the folder depth_raw/ is not used")

# Depths that no room has; images of another size than the camera; a list as input; colour without its list of depth.
recording(r rgb depth)
file(WRITE ${WORK}/one.toml "${camera}")
string(REGEX REPLACE "depth_scale = [0-9.]+" "depth_scale = 1.0" one "${camera}")
file(WRITE ${WORK}/one.toml "${one}")
execute_process(COMMAND ${APP} run r --camera one.toml --out out ${quick} WORKING_DIRECTORY ${WORK} ERROR_VARIABLE err)
check(err MATCHES "the median depth of frame 0 is [0-9]+ m .[0-9]+ / depth_scale 1.. with depth_scale")
string(REGEX REPLACE "depth_scale = [0-9.]+" "depth_scale = 1000.0" one "${camera}")
file(WRITE ${WORK}/one.toml "${one}")  # five times too far
execute_process(COMMAND ${APP} run r --camera one.toml --out out ${quick} WORKING_DIRECTORY ${WORK} ERROR_VARIABLE err)
check(err MATCHES "the median depth of frame 0 is [0-9]+ m .[0-9]+ / depth_scale 1000.. with depth_scale 5000[^\n]*above 4 m are not used for the map")
app_fails(2 "pixels, but the camera has 640x480; use a camera of this size" run r --camera kinect --quiet --out out ${quick})
app_fails(2 "rgb.txt: is a text file, not.*specify its folder, .*/room" run room/rgb.txt --quiet --out out ${quick})
file(COPY ${WORK}/room/rgb.txt DESTINATION ${WORK}/r)
app_fails(2 "depth.txt: no such file.*--format folders.*--sensor mono" run r --quiet --out out ${quick})
app(0 run r --format folders --out out ${quick})

# A clock in milliseconds that does not count from 1970.
file(WRITE ${WORK}/r/rgb.txt "0 rgb/000000.png\n33.4 rgb/000001.png\n66.7 rgb/000002.png\n100 rgb/000003.png\n")
file(WRITE ${WORK}/r/depth.txt "0 depth/000000.png\n33.4 depth/000001.png\n66.7 depth/000002.png\n100 depth/000003.png\n")
app(0 run r --out out ${quick})
check(err MATCHES "the time between frames is 33[.0-9]* s, .*seem to be 1000 times too large")

# An image, or one of the folders, instead of the recording.
recording(r color depth)
app_fails(2 "000000.png: is a single image. specify its folder, .*/r/color" run r/color/000000.png --quiet --out out ${quick})
execute_process(COMMAND ${APP} run r/color --camera r/camera.toml --out out ${quick} WORKING_DIRECTORY ${WORK} ERROR_VARIABLE err)
check(err MATCHES "the parent folder [^\n]*/r is a recording with depth")

app_fails(2 "the parent folder [^\n]*/room is a recording with depth: open that folder" run room/rgb --quiet --out out ${quick})
file(MAKE_DIRECTORY ${WORK}/up)
file(COPY ${WORK}/r DESTINATION ${WORK}/up)
app_fails(2 "up: is not a recording, but contains one: open up/r" run up --quiet --out out ${quick})

# Three lines for a folder that is no recording.
file(WRITE ${WORK}/nothing/readme.md "")
app(2 run nothing --out out)
check(err MATCHES "^rgbd_slam: nothing: not a known recording. the folder holds readme.md.\n  known layouts: [^\n]*\n  with two cameras [^\n]*. with one [^\n]*\n$")
