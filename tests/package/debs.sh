#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes the Debian packages of a shared build, checks them with lintian, installs them into a root without lrt, and builds and runs a consumer with
# CMake and one with pkg-config from what is in there.
#
#   tests/package/debs.sh FOLDER           builds in FOLDER (created if missing). The root has the packages' files only; the consumers run on this
#                                          machine, with the packages that are declared as dependencies taken from it
#   tests/package/debs.sh FOLDER --root    as root: the root is a Debian of its own, by debootstrap, in which apt installs the packages with their
#                                          dependencies and a compiler. It loads 150 MB from a mirror
#
# The packages are FOLDER/packages/*.deb.
set -euo pipefail

here=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd)
source_root=$(cd -- "$here/../.." && pwd)
if (($# < 1 || $# > 2)) || { (($# == 2)) && [[ $2 != --root ]]; }; then
  echo "usage: $0 FOLDER [--root]" >&2
  exit 2
fi
mkdir -p "$1"
folder=$(cd -- "$1" && pwd)
# shellcheck disable=SC2016  # apt-get expands it
mirror=${LRT_DEBIAN_MIRROR:-$(apt-get indextargets --format '$(SITE)' 2>/dev/null | grep -v security | head -n 1)}  # that of this machine
suite=${LRT_DEBIAN_SUITE:-bookworm}
work=$(mktemp -d)
trap 'rm -rf --one-file-system "$work"' EXIT

for tool in dpkg-deb dpkg-shlibdeps objcopy xz; do
  if ! command -v "$tool" >/dev/null; then
    echo "skipped: $tool is not found; install dpkg-dev, or run vendor/install.sh ci"
    exit 0
  fi
done
if command -v ninja >/dev/null; then export CMAKE_GENERATOR="${CMAKE_GENERATOR:-Ninja}"; fi
if command -v ccache >/dev/null; then export CMAKE_CXX_COMPILER_LAUNCHER="${CMAKE_CXX_COMPILER_LAUNCHER:-ccache}"; fi

# The objects are those of a build with the preset dev.
cmake -S "$source_root" -B "$folder" -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_INSTALL_PREFIX=/usr -DBUILD_SHARED_LIBS=ON -DLRT_BUILD_TESTS=OFF \
  -DLRT_BUILD_EXAMPLES=OFF -DCMAKE_SHARED_LINKER_FLAGS=-Wl,-z,relro,-z,now -DCMAKE_EXE_LINKER_FLAGS=-Wl,-z,relro,-z,now >"$work/log" || {
  cat "$work/log"
  exit 1
}
cmake --build "$folder" -j 2
rm -rf "$folder/packages"
(cd "$folder" && cpack -G DEB -B "$folder/packages") >"$work/log" 2>&1 || {
  cat "$work/log"
  exit 1
}
rm -rf "$folder/packages/_CPack_Packages"
debs=("$folder"/packages/*.deb)
ls -l "$folder/packages"
for deb in "${debs[@]}"; do dpkg-deb --field "$deb" Package Depends Recommends; done

if command -v lintian >/dev/null; then
  lintian --allow-root --fail-on error,warning --tag-display-limit 0 "${debs[@]}"
  echo "lintian: clean"
else
  echo "skipped: lintian is not found; install lintian, or run vendor/install.sh ci"
fi

# consumers ROOT: builds and runs one consumer with each tool, with the files below ROOT and the compiler here.
version=$(sed -n 's/^#define LRT_VERSION "\(.*\)"$/\1/p' "$source_root/include/lrt/version.hpp")
consumers() {
  local root=$1 libdir flags=()
  libdir=/usr/lib/$(dpkg-architecture -q DEB_HOST_MULTIARCH)
  export LD_LIBRARY_PATH=$root$libdir
  cmake -S "$here/find_package" -B "$work/consumer" -DCMAKE_PREFIX_PATH="$root/usr" -DLRT_WANTED="$version" -DCLIENT=ON >"$work/log" || {
    cat "$work/log"
    return 1
  }
  cmake --build "$work/consumer" >"$work/log" || {
    cat "$work/log"
    return 1
  }
  "$work/consumer/consumer" "$version"
  "$work/consumer/client_consumer"
  echo "CMake: a consumer was built and run"
  read -ra flags <<<"$(PKG_CONFIG_PATH=$root$libdir/pkgconfig pkg-config --cflags --libs lrt)"
  "${CXX:-c++}" -std=c++17 "$here/main.cpp" "${flags[@]}" -o "$work/program"
  "$work/program" "$version"
  echo "pkg-config: a consumer was built and run"
  "$root/usr/bin/lrt" --version
}

if [[ ${2:-} != --root ]]; then
  root=$work/root
  for deb in "${debs[@]}"; do dpkg-deb -x "$deb" "$root"; done
  consumers "$root"
  echo "skipped: a Debian of its own in the root, which takes minutes and a mirror: $0 FOLDER --root"
  exit 0
fi

if [[ $(id -u) != 0 ]] || ! command -v debootstrap >/dev/null; then
  echo "skipped: --root needs the rights of root, and debootstrap"
  exit 0
fi
root=$work/root
debootstrap --variant=minbase "$suite" "$root" "$mirror" >"$work/log" 2>&1 || {
  tail -n 20 "$work/log"
  echo "skipped: debootstrap found no $suite at $mirror (LRT_DEBIAN_MIRROR, LRT_DEBIAN_SUITE)"
  exit 0
}
mkdir "$root/lrt" "$root/lrt/package"
cp "${debs[@]}" "$root/lrt/"
cp -r "$here"/*.cpp "$here/find_package" "$root/lrt/package/"
cat >"$root/lrt/run.sh" <<'IN_ROOT'
#!/bin/sh
set -eu
export DEBIAN_FRONTEND=noninteractive
apt-get install -y -q --no-install-recommends /lrt/*.deb >/lrt/log 2>&1 || { tail -n 20 /lrt/log; exit 1; }
ldconfig -p | grep liblrt
lrt --version
apt-get install -y -q --no-install-recommends g++ cmake make pkg-config >/lrt/log 2>&1 || { tail -n 20 /lrt/log; exit 1; }
cmake -S /lrt/package/find_package -B /lrt/build -DLRT_WANTED="$1" -DCLIENT=ON -DQUERY=ON -DMQTT=ON
cmake --build /lrt/build
/lrt/build/consumer "$1"
/lrt/build/client_consumer
/lrt/build/query_consumer
/lrt/build/mqtt_consumer
# shellcheck disable=SC2046  # one argument per flag
c++ -std=c++17 /lrt/package/main.cpp $(pkg-config --cflags --libs lrt) -o /lrt/program
/lrt/program "$1"
apt-get purge -y -q 'liblrt*' lrt-tools >/lrt/log 2>&1
if ldconfig -p | grep liblrt; then echo "ldconfig still knows liblrt"; exit 1; fi
IN_ROOT
chroot "$root" sh /lrt/run.sh "$version"
echo "in a Debian of its own: installed, consumers built and run, removed"
