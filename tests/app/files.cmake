# SPDX-License-Identifier: BSD-3-Clause
#
# Recordings in one file: ROS bags and videos, as far as this build reads them.
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)

execute_process(COMMAND ${MAKE_INPUTS} ${WORK}/in 20 320 RESULT_VARIABLE result OUTPUT_VARIABLE made)
check(result EQUAL 0)

file(WRITE ${WORK}/empty.bag "")
app(0 run in/room.bag --deterministic --resolution 0.1 --out bag)
check(err MATCHES "images from /camera/color/image_raw and /camera/depth_registered/image")
summary(tracked ${WORK}/bag tracked)
check(tracked EQUAL 20)
must_exist(${WORK}/bag trajectory.txt cloud.ply map.bt summary.json report.html)
app(0 run in/room --truth-topic /odom --deterministic --resolution 0.1 --out rosbag2)
check(err MATCHES "room: 20 frames, 320 x 240, images from /camera/color/image_raw and /camera/depth/image_rect_raw .registered by tf., with ground truth from /odom .camera in world.")
summary(ate ${WORK}/rosbag2 ate_rmse_m)
check(ate LESS 0.01)
app_fails(2 "has no poses in /none; there are poses in /odom" run in/room --truth-topic /none --out out)
app(0 run in/room.bag --topics /camera/color/image_raw,/camera/depth_registered/image --deterministic --frames 3 --resolution 0.1 --out two)
app_fails(2 "has no images in /none; it contains /camera/color/image_raw .rgb8., /camera/depth_registered/image .32FC1."
          run in/room.bag --topics /none --out out)
app_fails(2 "is not a readable bag" run empty.bag --out out)
app_fails(3 "tracking never started" run in/room.bag --topics /camera/color/image_raw --frames 2 --out out)

file(WRITE ${WORK}/no.avi "no video")
if(made MATCHES "pair.avi")
  app(0 run in/pair.avi --sensor stereo --deterministic --filter none --resolution 0.1 --out video)
  summary(tracked ${WORK}/video tracked)
  check(tracked EQUAL 20)
  check(NOT err MATCHES "truncated")
  execute_process(COMMAND head -c 100000 in/pair.avi WORKING_DIRECTORY ${WORK} OUTPUT_FILE ${WORK}/in/cut.avi)
  app(0 run in/cut.avi --sensor stereo --frames 2 --filter none --resolution 0.1 --out cut)
  check(err MATCHES "the video is truncated or damaged: it has 0.[0-9]+ s of images, but declares")
  app_fails(2 "pair.avi: the image has 640x240 pixels, but the camera has 320x240" run in/pair.avi --out out)
  app_fails(2 "no.avi: is a text file, not a folder, a bag, or a video that OpenCV can read" run no.avi --out out)
else()
  app_fails(2 "no.avi: is not a folder, and this build has no support for videos: .*libopencv-videoio-dev" run no.avi --out out)
endif()
