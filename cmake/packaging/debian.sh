#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# usage: debian.sh DIR    builds liborbis-dev from a copy of the sources, checks it with lintian, and moves it to DIR
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
mkdir -p "$1"
out=$(cd "$1" && pwd)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

mkdir "$scratch/orbis"
cp -r "$root"/{CMakeLists.txt,CHANGELOG.md,LICENSE,README.md,cmake,include} "$scratch/orbis"
mv "$scratch/orbis/cmake/packaging/debian" "$scratch/orbis/debian"
cd "$scratch/orbis"
DEB_BUILD_OPTIONS="parallel=${JOBS:-$(nproc)} ${DEB_BUILD_OPTIONS:-}" dpkg-buildpackage --build=binary --no-sign
cd ..
# The package belongs to no distribution: it closes no bug and has no valid mail address.
lintian --fail-on error --suppress-tags initial-upload-closes-no-bugs,bogus-mail-host,bogus-mail-host-in-debian-changelog ./*.changes
rm -f "$out"/*.deb
mv ./*.deb "$out"
printf 'done: %s\n' "$out"/*.deb
