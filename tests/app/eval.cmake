# SPDX-License-Identifier: BSD-3-Clause
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)

# A square whose corners are 1 cm above and below the true ones by turns: no rigid motion betters
# that, so the error is 1 cm.
set(identity "0 0 0 1")
file(WRITE ${WORK}/truth.txt "# time x y z q\n0 1 1 0 ${identity}\n1 -1 1 0 ${identity}\n2 -1 -1 0 ${identity}\n3 1 -1 0 ${identity}\n")
file(WRITE ${WORK}/estimate.txt "0 1 1 .01 ${identity}\n1 -1 1 -.01 ${identity}\n2 -1 -1 .01 ${identity}\n3 1 -1 -.01 ${identity}\n")
app(0 eval estimate.txt truth.txt)
check(out MATCHES "RMSE 0.0100 m")
app(0 eval estimate.txt truth.txt --json)
string(JSON pairs GET "${out}" pairs)
check(pairs EQUAL 4)
string(JSON ate GET "${out}" ate_rmse_m)
check(ate GREATER 0.00999 AND ate LESS 0.01001)
string(JSON rpe GET "${out}" rpe_trans_rmse_m)
check(rpe GREATER 0.01999 AND rpe LESS 0.02001)

app_fails(2 "nowhere.txt: no such file" eval nowhere.txt truth.txt)
file(WRITE ${WORK}/bad.txt "0 1 1 0 ${identity}\n1 nan 1 0 ${identity}\n")
app_fails(2 "bad.txt:2: .*NaN" eval estimate.txt bad.txt)
file(WRITE ${WORK}/elsewhen.txt "100 1 1 0 ${identity}\n101 1 1 0 ${identity}\n")
app_fails(2 "estimate.txt: " eval estimate.txt elsewhen.txt)
app_fails(1 "GROUNDTRUTH" eval estimate.txt)

if(EXISTS ${DATA}/trajectories)
  app(0 eval ${DATA}/trajectories/freiburg1_xyz-rgbdslam.txt ${DATA}/trajectories/freiburg1_xyz-groundtruth.txt --json)
  string(JSON ate GET "${out}" ate_rmse_m)
  check(ate GREATER 0.0134 AND ate LESS 0.0135)
endif()
