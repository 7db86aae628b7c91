# SPDX-License-Identifier: BSD-3-Clause
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)

set(room demo --plain --frames 10 --width 320 --deterministic --filter none --quiet)

function(must_have folder profile resolution)
  summary(named ${WORK}/${folder} profile)
  check(named STREQUAL ${profile})
  summary(edge ${WORK}/${folder} octree resolution_m)
  check(edge EQUAL ${resolution})
endfunction()

app(0 ${room} --out usual)
must_have(usual default 0.05)
file(READ ${WORK}/usual/report.html page)
check(NOT page MATCHES "<td>profile</td>")

# SLAM and the map follow the profile, and who reads the results is told.
app(0 ${room} --profile small --out small)
must_have(small small 0.1)
summary(usual ${WORK}/usual landmarks)
summary(fewer ${WORK}/small landmarks)
check(fewer LESS usual)
file(READ ${WORK}/small/report.html page)
check(page MATCHES "<td>profile</td><td>small</td>")
summary(ate ${WORK}/small ate_rmse_m)
check(ate LESS 0.05)

# Options that are given win, wherever the profile and they stand.
app(0 ${room} --resolution 0.2 --profile small --out given)
must_have(given small 0.2)
app(0 ${room} --resolution 0.05 --profile small --out as_usual)  # the default, but given
must_have(as_usual small 0.05)
file(WRITE ${WORK}/profile.toml "profile = \"small\"\nresolution = 0.25\n")
app(0 ${room} --config profile.toml --out from_file)
must_have(from_file small 0.25)
app(0 ${room} --config profile.toml --profile default --resolution 0.2 --out over_file)
must_have(over_file default 0.2)

# Without SLAM it is the map's part alone.
app(0 map small/cloud.ply --profile small --filter none --quiet --out cloud)
must_have(cloud small 0.1)

app_fails(1 "--profile.*tiny" ${room} --profile tiny --out out)
app_fails(1 "--profile" eval a b --profile small)
