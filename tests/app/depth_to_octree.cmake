# SPDX-License-Identifier: BSD-3-Clause
#
# The example depth_to_octree (-DAPP), its map read back by OctoMap (-DREAD_BACK), and what it says to
# wrong arguments and damaged files.
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)
make_recording(${WORK}/room 1 320)
set(depth room/depth/000000.png)

# Prints `size resolution occupied free` as OctoMap counts them.
function(read_back file variable)
  execute_process(COMMAND ${READ_BACK} ${WORK}/${file} RESULT_VARIABLE result OUTPUT_VARIABLE out)
  check(result EQUAL 0)
  string(STRIP "${out}" out)
  set(${variable} "${out}" PARENT_SCOPE)
endfunction()

# Usage: 1.
macro(fails code message)
  app(${code} ${ARGN})
  if(NOT err MATCHES "^depth_to_octree: [^\n]*${message}[^\n]*\n$")
    message(FATAL_ERROR "depth_to_octree ${ARGN}\nsaid\n${err}instead of one line that matches \"${message}\"")
  endif()
  check(NOT EXISTS ${WORK}/no.bt)
endmacro()
fails(1 "DEPTH")
fails(1 "MAP" ${depth})
fails(1 "--pose.*7" ${depth} no.bt --pose 1 2 3)
fails(1 "--pose" ${depth} no.bt --pose 0 0 0 0 0 0 0)
fails(1 "--pose" ${depth} no.bt --pose nan 0 0 0 0 0 1)
fails(1 "--camera" ${depth} no.bt --camera 1,2,3)
fails(1 "--camera" ${depth} no.bt --camera -1,2,3,4)
fails(1 "--camera: fx = 1e-06 is too short a focal length for images of 320 x 240" ${depth} no.bt --camera 0.000001,0.000001,160,120)
fails(1 "--resolution" ${depth} no.bt --resolution 0)
fails(1 "--resolution" ${depth} no.bt --resolution nan)
fails(1 "--scale" ${depth} no.bt --scale -1)
fails(1 "--nonsense" ${depth} no.bt --nonsense)
app(0 --help)
check(out MATCHES "--camera" AND out MATCHES "--pose")

# Input, and output that cannot be: 2.
fails(2 "nowhere.png: no such file" nowhere.png no.bt)
file(WRITE ${WORK}/text.png "this is no picture")
fails(2 "text.png" text.png no.bt)
fails(2 "none.toml: no such file" ${depth} no.bt --camera none.toml)
file(WRITE ${WORK}/other.toml "model = \"pinhole\"\nwidth = 640\nheight = 480\nfx = 500\nfy = 500\ncx = 320\ncy = 240\n")
fails(2 "other.toml: .*size" ${depth} no.bt --camera other.toml)
fails(2 "no/such/folder" ${depth} no/such/folder/map.bt)
# A full disk, with the words of the system; long arguments are quoted in part.
execute_process(COMMAND bash -c "ulimit -f 1; exec \"$@\"" limited ${APP} ${depth} no.bt --resolution 0.02
                WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result ERROR_VARIABLE err)
check(result EQUAL 2)
check(err STREQUAL "depth_to_octree: no.bt: cannot be written: File too large\n")
check(NOT EXISTS ${WORK}/no.bt)
string(REPEAT "1 2, " 400 long)
foreach(arguments "no.bt;--camera;${long}x" "no.bt;--pose;${long}" "no.bt;${long}" "no.bt;--resolution;${long}" "${long}/no.bt")
  app(1|2 ${depth} ${arguments})
  string(LENGTH "${err}" said)
  check(said LESS 400)
endforeach()

file(WRITE ${WORK}/misspelt.toml "model = \"pinhole\"\nwidth = 320\nheight = 240\nfx = 262.5\nfy = 262.5\ncx = 159.5\ncy = 119.5\ndepth_skale = 5000\n")
fails(2 "misspelt.toml: depth_skale is not a camera setting" ${depth} no.bt --camera misspelt.toml)
fails(2 "tum_fr1: .*size" ${depth} no.bt --camera tum_fr1)  # known, but of 640 x 480
fails(2 "nikon: no such file" ${depth} no.bt --camera nikon)
# Nothing of it ends up in the map: too far away to have a key.
fails(2 "000000.png: no depth" ${depth} no.bt --pose 0 0 90000 0 0 0 1)

# Voxels so small that one image has billions of them; some that only take long are warned of.
# What is read is not written over.
file(SHA256 ${WORK}/${depth} before)
file(SHA256 ${WORK}/room/camera.toml camera_before)
fails(1 "000000.png: is an input" ${depth} ${depth} --camera room/camera.toml)
fails(1 "camera.toml: is an input" ${depth} room/camera.toml --camera room/camera.toml)
file(SHA256 ${WORK}/${depth} after)
check(before STREQUAL after)
file(SHA256 ${WORK}/room/camera.toml after)
check(camera_before STREQUAL after)

# A camera of which each pixel has decimetres to itself: said beforehand, and ended where there is no memory for it.
execute_process(COMMAND bash -c "ulimit -v 400000; exec \"$@\"" limited ${APP} ${depth} no.bt --camera 32,32,160,120 --resolution 0.015
                WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result ERROR_VARIABLE err)
check(result EQUAL 2)
if(NOT err MATCHES "^depth_to_octree: the image has about [^\n]* billion voxels of 15 mm [^\n]* GB.. this takes a long time\ndepth_to_octree: out of memory\n$")
  message(FATAL_ERROR "depth_to_octree said\n${err}")
endif()
check(NOT EXISTS ${WORK}/no.bt)

fails(2 "--resolution: the image has about .* voxels of 0.2 mm .* too many" ${depth} no.bt --resolution 0.0002 --scale 1000)

# The same camera, as a file and as numbers.
app(0 ${depth} map.bt --camera room/camera.toml --pose 1 2 0.5 0 0 0 1)
app(0 ${depth} again.bt --camera 262.5,262.5,159.5,119.5 --scale 5000 --pose 1 2 0.5 0 0 0 2)
must_equal(map.bt again.bt)
read_back(map.bt counts)
check(counts MATCHES "^[0-9]+ 0.05 [1-9][0-9][0-9]+ [1-9][0-9][0-9]+ 1 2 0.5 free$")

# Another resolution, scale and pose make another map: at half the depth there is less free space.
app(0 ${depth} small.bt --camera room/camera.toml --scale 10000 --resolution 0.1 --pose 0 0 0 0 0 0 1)
read_back(small.bt counts)
check(counts MATCHES "^[0-9]+ 0.1 [1-9][0-9]+ [1-9][0-9]+ 1 2 0.5 unknown$")
