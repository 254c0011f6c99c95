#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs what is missing, builds, and serves Baxter's right arm at http://127.0.0.1:8080/ until Ctrl-C.
#
#   examples/run.sh [--tls] [arguments of the example: --port N, --bind ADDRESS, --public-base URL, --allowed-host HOST,
#                    --cors ORIGIN, --demo, --allow-callback HOST, --subscriptions FILE, --transport http|libwebsockets]
#
# --tls: HTTPS with a development certificate in build/tls; curl --cacert build/tls/ca.pem https://localhost:8080/
set -eu

root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
"$root/vendor/install.sh" urdf

if command -v ninja >/dev/null; then export CMAKE_GENERATOR="${CMAKE_GENERATOR:-Ninja}"; fi
if command -v ccache >/dev/null; then export CMAKE_CXX_COMPILER_LAUNCHER="${CMAKE_CXX_COMPILER_LAUNCHER:-ccache}"; fi

(
  cd "$root"
  cmake --preset release --log-level=WARNING
  cmake --build --preset release --target baxter
)
tls=
for argument; do
  shift
  if [ "$argument" = --tls ]; then tls=yes; else set -- "$@" "$argument"; fi
done
if [ -n "$tls" ]; then
  if [ ! -f "$root/build/tls/server-key.pem" ]; then "$root/examples/make-certificate.sh" "$root/build/tls"; fi
  set -- --tls "$root/build/tls" "$@"
fi
exec "$root/build/release/examples/baxter/baxter" "$@"
