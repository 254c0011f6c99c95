#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes the Debian packages of a shared build, checks them with lintian, installs them into a root without lrt, and builds and runs a consumer of each
# library with CMake and one with pkg-config from what is in there. Exits with 77 where the tools or the rights are missing.
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
    exit 77
  fi
done
if command -v ninja >/dev/null; then export CMAKE_GENERATOR="${CMAKE_GENERATOR:-Ninja}"; fi
if command -v ccache >/dev/null; then export CMAKE_CXX_COMPILER_LAUNCHER="${CMAKE_CXX_COMPILER_LAUNCHER:-ccache}"; fi

# Each source is compiled alone: a program that is linked with an archive gets what it uses, and a missing #include shows.
cmake -S "$source_root" -B "$folder" -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_INSTALL_PREFIX=/usr -DBUILD_SHARED_LIBS=ON -DLRT_BUILD_TESTS=OFF \
  -DLRT_BUILD_EXAMPLES=OFF -DLRT_UNITY_BUILD=OFF -DCMAKE_SHARED_LINKER_FLAGS=-Wl,-z,relro,-z,now -DCMAKE_EXE_LINKER_FLAGS=-Wl,-z,relro,-z,now >"$work/log" || {
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
for deb in "${debs[@]}"; do dpkg-deb --field "$deb" Package Multi-Arch Depends Recommends Suggests; done

# What packages of others will depend on (>=), what these depend on (=), and first lines of which none is another's.
version=$(sed -n 's/^#define LRT_VERSION "\(.*\)"$/\1/p' "$source_root/include/lrt/version.hpp")
abi=$(sed -n 's/^#define LRT_ABI //p' "$source_root/include/lrt/version.hpp")
for deb in "${debs[@]}"; do
  name=$(dpkg-deb --field "$deb" Package)
  if dpkg-deb --info "$deb" | grep ' shlibs' >/dev/null; then
    dpkg-deb --info "$deb" shlibs | tee "$work/shlibs"
    if grep -vE "^liblrt[a-z0-9_]* $abi $name \\(>= ${version//./\\.}-[^ ]+\\)$" "$work/shlibs"; then
      echo "$name: expected \">= $version-REVISION\" in shlibs: libraries of one LRT_ABI can replace each other"
      exit 1
    fi
  fi
  if dpkg-deb --field "$deb" Depends | tr ',' '\n' | grep -E '^ *liblrt' | grep -vF "(= $version-"; then
    echo "$name: expected exactly this version of the other packages of lrt"
    exit 1
  fi
done
same=$(for deb in "${debs[@]}"; do dpkg-deb --field "$deb" Description | head -n 1; done | sort | uniq -d)
if [[ -n $same ]]; then
  echo "several packages have the first line: $same"
  exit 1
fi

if command -v lintian >/dev/null; then
  lintian --allow-root --fail-on error,warning --tag-display-limit 0 "${debs[@]}"
  echo "lintian: clean"
else
  echo "skipped: lintian is not found; install lintian, or run vendor/install.sh ci"
fi

# consumers ROOT: builds and runs a consumer of each library with CMake and one with pkg-config, with the files below ROOT and the compiler here.
consumers() {
  local root=$1 libdir flags=() wanted=(-DCLIENT=ON -DQUERY=ON) component
  libdir=/usr/lib/$(dpkg-architecture -q DEB_HOST_MULTIARCH)
  for component in urdf mqtt protobuf librdf ros2; do
    if compgen -G "$folder/packages/liblrt-$component*.deb" >/dev/null; then
      wanted+=("-D${component^^}=ON")
    else
      echo "skipped: lrt::$component is left out of this build"
    fi
  done
  export LD_LIBRARY_PATH=$root$libdir
  rm -rf "$folder/consumer"
  cmake -S "$here/find_package" -B "$folder/consumer" -DCMAKE_PREFIX_PATH="$root/usr" -DLRT_WANTED="$version" "${wanted[@]}" >"$work/log" || {
    cat "$work/log"
    return 1
  }
  cmake --build "$folder/consumer" -j 2 >"$work/log" || {
    cat "$work/log"
    return 1
  }
  "$folder/consumer/consumer" "$version"
  for component in client client_tools query mqtt protobuf librdf ros2; do
    if [[ -x $folder/consumer/${component}_consumer ]]; then "$folder/consumer/${component}_consumer"; fi
  done
  if [[ -x $folder/consumer/urdf_consumer ]]; then "$folder/consumer/urdf_consumer" "$source_root/examples/ex_urdf_robot/picker.urdf"; fi
  echo "CMake: built and run:" "$folder/consumer"/*consumer
  read -ra flags <<<"$(PKG_CONFIG_PATH=$root$libdir/pkgconfig pkg-config --cflags --libs lrt)"
  "${CXX:-c++}" -std=c++17 "$here/main.cpp" "${flags[@]}" -o "$work/program"
  "$work/program" "$version"
  echo "pkg-config: a consumer was built and run"
  "$root/usr/bin/lrt" --version
  if [[ -x $root/usr/bin/lrt-ros2 ]]; then "$root/usr/bin/lrt-ros2" --version; fi
  PYTHONPATH=$root/usr/lib/python3/dist-packages python3 -B -c 'import lrt; print("Python:", lrt.__file__)'
}

if [[ ${2:-} != --root ]]; then
  root=$folder/root  # always the same, so that ccache knows the consumers
  rm -rf "$root"
  for deb in "${debs[@]}"; do dpkg-deb -x "$deb" "$root"; done
  consumers "$root"
  echo "$0 FOLDER --root does this in a Debian of its own, which takes minutes and a mirror"
  exit 0
fi

if [[ $(id -u) != 0 ]] || ! command -v debootstrap >/dev/null; then
  echo "skipped: --root needs the rights of root, and debootstrap"
  exit 77
fi
root=$work/root
debootstrap --variant=minbase "$suite" "$root" "$mirror" >"$work/log" 2>&1 || {
  tail -n 20 "$work/log"
  echo "skipped: debootstrap found no $suite at $mirror (LRT_DEBIAN_MIRROR, LRT_DEBIAN_SUITE)"
  exit 77
}
mkdir "$root/lrt" "$root/lrt/package"
cp "${debs[@]}" "$root/lrt/"
cp -r "$here"/*.cpp "$here/find_package" "$source_root/examples/ex_urdf_robot/picker.urdf" "$root/lrt/package/"
cat >"$root/lrt/run.sh" <<'IN_ROOT'
#!/bin/sh
set -eu
export DEBIAN_FRONTEND=noninteractive
apt-get install -y -q --no-install-recommends /lrt/*.deb >/lrt/log 2>&1 || { tail -n 20 /lrt/log; exit 1; }
ldconfig -p | grep liblrt
lrt --version
if command -v lrt-ros2; then lrt-ros2 --version; fi
apt-get install -y -q --no-install-recommends g++ cmake make pkg-config libprotobuf-dev librdf0-dev >/lrt/log 2>&1 || { tail -n 20 /lrt/log; exit 1; }
cmake -S /lrt/package/find_package -B /lrt/build -DLRT_WANTED="$1" -DCLIENT=ON -DQUERY=ON -DURDF=ON -DMQTT=ON -DPROTOBUF=ON -DLIBRDF=ON -DROS2=ON
cmake --build /lrt/build
/lrt/build/consumer "$1"
/lrt/build/client_consumer
/lrt/build/client_tools_consumer
/lrt/build/query_consumer
/lrt/build/urdf_consumer /lrt/package/picker.urdf
/lrt/build/mqtt_consumer
/lrt/build/protobuf_consumer
/lrt/build/librdf_consumer
/lrt/build/ros2_consumer
# shellcheck disable=SC2046  # one argument per flag
c++ -std=c++17 /lrt/package/main.cpp $(pkg-config --cflags --libs lrt) -o /lrt/program
/lrt/program "$1"
apt-get purge -y -q 'liblrt*' lrt-tools lrt-ros2 >/lrt/log 2>&1
if ldconfig -p | grep liblrt; then echo "ldconfig still knows liblrt"; exit 1; fi
IN_ROOT
chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin sh /lrt/run.sh "$version"
echo "in a Debian of its own: installed, consumers built and run, removed"
