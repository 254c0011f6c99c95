#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds, and serves Baxter's right arm at http://127.0.0.1:8080/ until Ctrl-C.
#
#   examples/run.sh [--tls] [arguments of the example: --port N, --bind ADDRESS, --public-base URL, --allowed-host HOST,
#                    --cors ORIGIN, --demo, --allow-callback HOST, --subscriptions FILE, --transport http|libwebsockets,
#                    --mqtt HOST:PORT, and further options of the broker and --identity FILE: examples/baxter/main.cpp]
#
#   examples/run.sh LESSON [its arguments]     serves a lesson instead: examples/run.sh t01_first_thing --serve 8080
#
# --tls: HTTPS with a development certificate in build/tls; curl --cacert build/tls/ca.pem https://localhost:8080/
#
# build/example gets only what the program needs: the transport libwebsockets and MQTT if an argument asks for them, Boost.Asio's loop and the client
# if the lesson uses them.
set -eu

root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
step() { echo "examples/run.sh: $*"; }

target=baxter
program=baxter/baxter
case ${1:-} in
  t[0-9][0-9]_*)
    target=$1
    program=$1
    shift
    ;;
esac
tls=
parts=
case $target in
  t16_asio_loop) parts=-DLRT_ASIO_LOOP=ON ;;
  t23_client) parts=-DLRT_CLIENT=ON ;;
esac
packages=urdf
for argument; do
  shift
  case $argument in
    --tls)
      tls=yes
      continue
      ;;
    libwebsockets) parts="$parts -DLRT_LIBWEBSOCKETS=ON" ;;
    --mqtt)
      parts="$parts -DLRT_MQTT=ON"
      packages="$packages mqtt"
      ;;
  esac
  set -- "$@" "$argument"
done

step "1 of 3: installs the packages that are missing"
# shellcheck disable=SC2086  # one argument per group
"$root/vendor/install.sh" $packages

if command -v ninja >/dev/null; then export CMAKE_GENERATOR="${CMAKE_GENERATOR:-Ninja}"; fi
if command -v ccache >/dev/null; then export CMAKE_CXX_COMPILER_LAUNCHER="${CMAKE_CXX_COMPILER_LAUNCHER:-ccache}"; fi
(
  cd "$root"
  step "2 of 3: configures build/example"
  # shellcheck disable=SC2086  # one argument per option
  cmake --preset example --log-level=WARNING $parts
  step "3 of 3: compiles and links in build/example; a minute on two cores, seconds if nothing has changed"
  NINJA_STATUS='[%f of %t, %e s] ' cmake --build --preset example --target "$target"
)
if [ -n "$tls" ]; then
  if [ ! -f "$root/build/tls/server-key.pem" ]; then "$root/examples/make-certificate.sh" "$root/build/tls"; fi
  set -- --tls "$root/build/tls" "$@"
fi
step "starts $target; Ctrl-C ends it"
exec "$root/build/example/examples/$program" "$@"
