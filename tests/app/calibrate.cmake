# SPDX-License-Identifier: BSD-3-Clause
#
# Calibration of a camera with a recording.
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)
make_recording(${WORK}/room 120 320)
file(READ ${WORK}/room/camera.toml given)
string(REGEX REPLACE "fx = [0-9.]+\nfy = [0-9.]+" "fx = 270.0\nfy = 270.0" wrong "${given}")
file(WRITE ${WORK}/wrong.toml "${wrong}")

app(0 calibrate room --camera wrong.toml --read-out-ms 0 --out found.toml)
check(NOT err MATCHES "distortion")
check(out MATCHES "fx +270\\.00 +26[0-9]\\.[0-9]+ +[0-9.]+\n")
check(out MATCHES "cx +159\\.50 ")
check(out MATCHES "depth_scale +5000")
file(READ ${WORK}/found.toml found)
string(REGEX MATCH "fx = ([0-9.]+)" fx "${found}")
check(CMAKE_MATCH_1 GREATER 259.5 AND CMAKE_MATCH_1 LESS 265.5)  # true: 262.5

# The file is valid for --camera, and better than its input.
app(0 run room --camera found.toml --read-out-ms 0 --deterministic --filter none --resolution 0.1 --out better)
check(NOT err MATCHES "doubtful")
app(0 run room --camera wrong.toml --read-out-ms 0 --deterministic --filter none --resolution 0.1 --out before)
check(err MATCHES "focal length is doubtful")
summary(better ${WORK}/better ate_rmse_m)
summary(before ${WORK}/before ate_rmse_m)
check(better LESS before)

# If a recording contradicts its camera, the run calibrates the camera, unless the user forbids it.
summary(from ${WORK}/before intrinsics from)
check(from MATCHES "^given$")
file(WRITE ${WORK}/room/camera.toml "${wrong}")
app(0 run room --deterministic --filter none --resolution 0.1 --out refined)
check(err MATCHES "the images contradict the camera's focal length of 270.0 pixels")
check(NOT err MATCHES "doubtful")
summary(from ${WORK}/refined intrinsics from)
check(from MATCHES "^refined$")
summary(fx ${WORK}/refined intrinsics fx)
check(fx GREATER 259.5 AND fx LESS 265.5)
summary(refined ${WORK}/refined ate_rmse_m)
check(refined LESS before)
file(READ ${WORK}/refined/report.html report)
check(report MATCHES "calibrated with the recording")
app(0 run room --camera refined/camera_used.toml --deterministic --filter none --resolution 0.1 --out once_more)
must_equal(refined/trajectory.txt once_more/trajectory.txt)
app(0 run room --intrinsics given --deterministic --filter none --resolution 0.1 --out as_given)
check(err MATCHES "focal length is doubtful")
summary(fx ${WORK}/as_given intrinsics fx)
check(fx EQUAL 270.0)
app(0 run room --save-map room.map --deterministic --filter none --resolution 0.1 --out shared)
summary(fx ${WORK}/shared intrinsics fx)
check(fx EQUAL 270.0)
file(WRITE ${WORK}/room/camera.toml "${given}")

# Distortion that the camera file does not model is not mistaken for another focal length.
make_recording(${WORK}/bent 120 320 - 0.15)
app(0 run bent --deterministic --filter none --resolution 0.1 --out bent_out)
check(NOT err MATCHES "focal length")
summary(fx ${WORK}/bent_out intrinsics fx)
check(fx GREATER 260 AND fx LESS 265)
app_fails(5 "does not determine the lens distortion" calibrate bent --frames 40 --distortion --read-out-ms 0 --out found.toml)
# Without --distortion the focal length (262.5) is wrong, and a warning says so.
app(0 calibrate bent --frames 60 --read-out-ms 0)
check(out MATCHES "fx +262\\.50 +2[0-4][0-9]\\.")
check(err MATCHES "does not determine whether the lens has distortion")

# Without poses the depth scale cannot be determined; without motion nothing can, and no file is written.
file(REMOVE ${WORK}/room/groundtruth.txt ${WORK}/found.toml)
app(0 calibrate room --frames 60 --read-out-ms 0)
check(out MATCHES "depth_scale: not determined by images alone")
app_fails(5 "no point is observed by two images" calibrate room --frames 3 --read-out-ms 0 --out found.toml)
check(NOT EXISTS ${WORK}/found.toml)
app_fails(1 "would be overwritten" calibrate room --out room/rgb/000000.png)
app_fails(1 "is a folder" calibrate room --out room)
app_fails(2 "nothing" calibrate nothing)
