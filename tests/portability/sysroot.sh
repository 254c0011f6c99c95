#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The libraries and headers that lrt needs, for another machine or another release of Debian, in a folder of their own: unpacked from the
# distribution's packages, none of which is installed. Does nothing when the folder is complete.
#
#   tests/portability/sysroot.sh ARCH [FOLDER]
#
#   ARCH               arm64, armhf, or another architecture of Debian
#   FOLDER             where to; default build/sysroot/ARCH
#   LRT_SUITE=NAME     packages of this release instead of the one that is installed here: trixie
#   LRT_PACKAGES=LIST  instead of what the library and its tests use
set -euo pipefail

root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/../.." && pwd)
arch=${1:?usage: $0 ARCH [FOLDER]}
folder=$(realpath -m "${2:-$root/build/sysroot/$arch}")
suite=${LRT_SUITE:-}
packages=${LRT_PACKAGES:-libc6-dev libstdc++-12-dev libpcre2-dev libssl-dev zlib1g-dev librdf0-dev libboost-dev libcpp-httplib-dev libwebsockets-dev
                         nlohmann-json3-dev libeigen3-dev catch2 libtinyxml2-dev libmosquitto-dev}
read -ra packages <<<"${packages//$'\n'/ }"

wanted="$suite ${packages[*]}"
if [[ -f $folder/.packages && $(<"$folder/.packages") == "$wanted" ]]; then exit 0; fi
if ! command -v apt-get >/dev/null || ! command -v dpkg-deb >/dev/null; then
  echo "$0: this system has no apt" >&2
  exit 1
fi

# A state of apt's own, as on a machine of that kind where nothing is installed.
state=$folder.apt
rm -rf "$folder" "$state"
mkdir -p "$folder" "$state"/{lists/partial,cache/archives/partial,parts}
: >"$state/status"
apt-get indextargets --format "\$(REPO_URI) \$(RELEASE) \$(COMPONENT)" 'Created-By: Packages' 'Origin: Debian' | sort -u |
  while read -r uri release component; do
    if [[ -n $suite ]]; then
      [[ $release =~ ^[a-z]+$ ]] || continue  # neither updates nor security
      release=$suite
    fi
    echo "deb [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $uri $release $component"
  done >"$state/sources.list"
[[ -s $state/sources.list ]] || {
  echo "$0: apt-get update first: apt knows no packages of Debian" >&2
  exit 1
}
options=(-q -o "Dir::State=$state" -o "Dir::State::status=$state/status" -o "Dir::Cache=$state/cache" -o "Dir::Etc::sourcelist=$state/sources.list"
         -o "Dir::Etc::sourceparts=$state/parts" -o "Dir::Etc::preferencesparts=$state/parts" -o "APT::Architecture=$arch"
         -o "APT::Architectures::=$arch" -o APT::Sandbox::User= -o "Debug::NoLocking=true" -o Acquire::Languages=none)
apt-get "${options[@]}" update || echo "$0: goes on without the lists that could not be had"
apt-get "${options[@]}" install -y --no-install-recommends --download-only "${packages[@]}" >"$state/log" || {
  cat "$state/log"
  exit 1
}
count=0
for package in "$state"/cache/archives/*.deb; do
  dpkg-deb -x "$package" "$folder"
  count=$((count + 1))
done
# Absolute links lead out of the folder.
find "$folder" -type l -lname '/*' | while read -r link; do ln -sfnr "$folder$(readlink "$link")" "$link"; done
rm -rf "$state"
printf '%s' "$wanted" >"$folder/.packages"
echo "$count packages of $arch in $folder, $(du -sh "$folder" | cut -f 1)"
