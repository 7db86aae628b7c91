#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
#
# Downloads the libraries of Debian 12 for 64-bit ARM that run.sh and tests/aarch64.sh need, and unpacks them into a
# folder. It installs nothing and does not change the package lists of this system.
#
# usage: bench/board/sysroot.sh FOLDER
set -euo pipefail
[[ $# == 1 ]] || { sed -n '4,8s/^# \{0,1\}//p' "$0" >&2; exit 1; }
if ! grep -qs '^VERSION_CODENAME=bookworm' /etc/os-release; then
  echo "sysroot.sh: needs Debian 12, whose package names it uses" >&2
  exit 1
fi
mkdir -p "$1"
root=$(cd "$1" && pwd)
mkdir -p "$root/.apt/state/lists/partial" "$root/.apt/cache/archives/partial"
: >"$root/.apt/status"
cat >"$root/.apt/conf" <<EOF
APT::Architecture "arm64";
APT::Architectures { "arm64"; };
Dir::State "$root/.apt/state";
Dir::State::status "$root/.apt/status";
Dir::Cache "$root/.apt/cache";
APT::Sandbox::User "root";
EOF
export APT_CONFIG="$root/.apt/conf"
apt-get update
cd "$root/.apt"
rm -f ../complete ./*.deb
apt-get download zlib1g{,-dev} libpng16-16 libpng-dev libjpeg62-turbo{,-dev} liboctomap{1.9,-dev} libtbb12 \
  libopencv-{core,flann,imgproc,features2d,calib3d}{406,-dev} liblapack3 libblas3 libgfortran5 \
  libgl1 libglx0 libglvnd0 libx11-6 libxcb1 libxau6 libxdmcp6 libbsd0 libmd0
for package in *.deb; do dpkg -x "$package" "$root"; done
: >"$root/complete"
