#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# versions.sh ROOT: checks that all files contain the same version of the project.
set -euo pipefail
cd "$1"
version=$(sed -n 's/^project(orbis VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
[[ -n $version ]] || { echo "CMakeLists.txt contains no version" >&2; exit 1; }
status=0
names() {  # file, required line
  grep -qF -- "$2" "$1" || { echo "$1: \"$2\" is missing" >&2; status=1; }
}
names CITATION.cff "version: $version"
names CHANGELOG.md "## [$version]"
names cmake/packaging/debian/changelog "orbis ($version-"
names cmake/packaging/vcpkg/vcpkg.json "\"version\": \"$version\""
names cmake/packaging/conan/conanfile.py "version = \"$version\""
names tests/consume/project/CMakeLists.txt "find_package(orbis ${version%.*} "
exit $status
