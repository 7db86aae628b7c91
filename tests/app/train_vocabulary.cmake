# SPDX-License-Identifier: BSD-3-Clause
#
# The example train_vocabulary (-DAPP): the same seed gives the same bytes, what it writes it can read, and what it says
# to wrong arguments and damaged files.
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)

macro(fails code message)
  app(${code} ${ARGN})
  if(NOT err MATCHES "^train_vocabulary: [^\n]*${message}[^\n]*\n$")
    message(FATAL_ERROR "train_vocabulary ${ARGN}\nsaid\n${err}instead of one line that matches \"${message}\"")
  endif()
  check(NOT EXISTS ${WORK}/no.voc)
endmacro()

# Usage: 1.
fails(1 "subcommand")
fails(1 "OUT" train)
fails(1 "--branching" train no.voc --branching 1)
fails(1 "--depth" train no.voc --depth 0)
fails(1 "--stride" recall --stride 0)
fails(1 "--nonsense" train no.voc --nonsense)
app(0 --help)
check(out MATCHES "train" AND out MATCHES "convert" AND out MATCHES "recall")

# Input, and output that cannot be: 2.
fails(2 "nowhere.voc: no such file" convert nowhere.voc no.voc)
file(WRITE ${WORK}/text.txt "3 2 0 0\n0 1 2 3\n")
fails(2 "text.txt:2: .*descriptor" convert text.txt no.voc)
file(WRITE ${WORK}/empty.txt "10 6 0 0\n")
fails(2 "empty.txt: the vocabulary contains no words" convert empty.txt no.voc)
set(small --textures 4 --rooms 1 --views 3 --features 150 --branching 5 --depth 2)
fails(2 "no/folder" train no/folder/no.voc ${small})
fails(2 "nowhere" train no.voc ${small} --recording nowhere)

# The same again, and another seed.
app(0 train first.voc ${small})
check(out MATCHES "^25 words, 31 nodes, 2 levels")
app(0 train again.voc ${small})
app(0 train other.voc ${small} --seed 2)
file(SHA256 ${WORK}/first.voc first)
file(SHA256 ${WORK}/again.voc again)
file(SHA256 ${WORK}/other.voc other)
check(first STREQUAL again)
check(NOT first STREQUAL other)
app(0 convert first.voc converted.voc)
file(SHA256 ${WORK}/converted.voc converted)
check(first STREQUAL converted)
fails(1 "converted.voc: is an input" convert converted.voc converted.voc)
file(SHA256 ${WORK}/converted.voc converted)
check(first STREQUAL converted)
# A pipe to which nobody writes.
execute_process(COMMAND mkfifo ${WORK}/pipe RESULT_VARIABLE result)
if(result EQUAL 0)
  fails(2 "pipe: is not a regular file" convert pipe no.voc)
endif()
app(0 recall first.voc --rooms 1)
check(out MATCHES "first.voc +25 rooms")

# A recording is not overwritten, directly or through a link.
execute_process(COMMAND ${MAKE_RECORDING} ${WORK}/room 3 160 RESULT_VARIABLE result)
check(result EQUAL 0)
file(CREATE_LINK room ${WORK}/linked SYMBOLIC)
foreach(name room/rgb.txt room/rgb/000000.png room/camera.toml linked/depth/000001.png)
  file(SHA256 ${WORK}/${name} before)
  fails(1 "${name}: is an input" train ${name} ${small} --recording room)
  file(SHA256 ${WORK}/${name} after)
  check(before STREQUAL after)
endforeach()
# Numbers that do not fit are not changed into others; damaged files are reported before any work.
fails(1 "--seed: .* is out of range" train no.voc ${small} --seed -1)
fails(1 "--seed: .* is out of range" train no.voc ${small} --seed 18446744073709551616)
fails(2 "text.txt:2: .*descriptor" recall text.txt --rooms 1000000)
