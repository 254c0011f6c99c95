#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs what lrt needs and this machine lacks, from the distribution's own packages. Does nothing when all is there.
#
#   vendor/install.sh          what the library, the lessons and most tests need
#   vendor/install.sh tests    that, lrt::urdf, lrt::mqtt, lrt::protobuf, lrt::librdf, lrt::ros2, and the clients of others that some tests use
#   vendor/install.sh urdf     what the library needs, and lrt::urdf besides: what examples/run.sh needs
#   vendor/install.sh mqtt     what the library needs, and lrt::mqtt besides, with a broker. Debian starts it as a service where systemd runs
#   vendor/install.sh protobuf what the library needs, and lrt::protobuf besides, with the compiler of messages
#   vendor/install.sh librdf   what the library needs, and lrt::librdf besides, with Redland's storage on SQLite
#   vendor/install.sh ros2     what the library needs, and lrt::ros2 besides, with the peers of its tests: Cyclone DDS, files of types
#   vendor/install.sh browser  what the library and most tests need, and the browser for the test of the page
#   vendor/install.sh proxies  what the library and most tests need, and the reverse proxies and caches of examples/reverse_proxy, examples/fleet_front
#                              and their tests. Debian starts them as services where systemd runs
#   vendor/install.sh stores   what the library and most tests need, and the RDF store of the test of `lrt mirror`. Debian starts it as a service where
#                              systemd runs; it takes 275 MB of memory
#   vendor/install.sh fleet    what the library and most tests need, lrt::mqtt with a broker, and Prometheus for examples/fleet_operations and its test.
#                              Debian starts both as services where systemd runs. Node-RED comes from npm: its test fetches it by name
#   vendor/install.sh ros      what the library and most tests need, and ROS 1 for examples/ex_ros_node and its test
#   vendor/install.sh cross    what the library and most tests need, and the cross compilers and the emulator of tests/portability/cross.sh
#   vendor/install.sh ci       all of that, and what .ci/run needs besides
#
# vendor/README.md names each package with its version and licence.
set -eu

build="g++ cmake ninja-build pkg-config ccache librdf0-dev libpcre2-dev libboost-dev libcpp-httplib-dev libwebsockets-dev libssl-dev zlib1g-dev nlohmann-json3-dev libeigen3-dev libcli11-dev libzstd-dev catch2"
urdf="libtinyxml2-dev"
mqtt="libmosquitto-dev mosquitto mosquitto-clients"
protobuf="libprotobuf-dev protobuf-compiler"
librdf="librdf0-dev librdf-storage-sqlite"
ros2="$urdf libfastrtps-dev libfastcdr-dev libtomlplusplus-dev cyclonedds-dev cyclonedds-tools ros2-test-interface-files"
tests="$urdf $mqtt $protobuf $librdf $ros2 python3 python3-websockets python3-rdflib curl jq openssl libjwt-dev"
proxies="nginx-light haproxy caddy varnish"
stores="virtuoso-opensource-7"
fleet="prometheus"
browser="python3 chromium chromium-driver"
ros="libroscpp-dev libsensor-msgs-dev python3-rosmaster python3-rospy python3-sensor-msgs"
cross="g++-aarch64-linux-gnu g++-arm-linux-gnueabihf qemu-user-static"
ci="clang clang-format-14 clang-tidy-14 libclang-rt-14-dev doxygen shellcheck codespell mandoc zsh tmux faketime valgrind libapache-jena-java default-jdk-headless dpkg-dev lintian abigail-tools xz-utils"

wanted=$build
for group in "$@"; do
  case $group in
    build) ;;
    urdf) wanted="$wanted $urdf" ;;
    mqtt) wanted="$wanted $mqtt" ;;
    protobuf) wanted="$wanted $protobuf" ;;
    librdf) wanted="$wanted $librdf" ;;
    ros2) wanted="$wanted $ros2" ;;
    tests) wanted="$wanted $tests" ;;
    browser) wanted="$wanted $browser" ;;
    proxies) wanted="$wanted python3 python3-websockets openssl $proxies" ;;
    stores) wanted="$wanted python3 python3-rdflib $stores" ;;
    fleet) wanted="$wanted $mqtt python3 $fleet" ;;
    ros) wanted="$wanted $ros" ;;
    cross) wanted="$wanted $cross" ;;
    ci) wanted="$wanted $tests $browser $proxies $stores $fleet $ros $cross $ci" ;;
    *)
      echo "usage: $0 [build] [urdf] [mqtt] [protobuf] [librdf] [ros2] [tests] [browser] [proxies] [stores] [fleet] [ros] [cross] [ci]" >&2
      exit 2
      ;;
  esac
done

if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
  {
    echo "$0: this system has no apt. Install these Debian packages' equivalents, then build with cmake:"
    echo "  $wanted"
    echo "vendor/README.md says what each is for and which version is known to work."
  } >&2
  exit 1
fi

missing=
for package in $wanted; do
  # shellcheck disable=SC2016  # dpkg-query expands it
  if [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" != installed ]; then
    missing="$missing $package"
  fi
done
[ -n "$missing" ] || exit 0

as_root=
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null; then
    echo "$0: not root, and there is no sudo. As root: apt-get install$missing" >&2
    exit 1
  fi
  as_root=sudo
fi

echo "Installing:$missing"
$as_root apt-get update -q
# shellcheck disable=SC2086  # one argument per package
$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $missing
