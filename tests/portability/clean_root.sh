#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# examples/run.sh and tests/run.sh for someone who has a fresh Debian and a clone: in a root of its own, by debootstrap, without the packages, settings
# and files of this machine. By hand, not in CI: it loads some 400 MB from a mirror, needs 12 GB below TMPDIR, and takes as long as a build from
# nothing and all tests.
#
#   tests/portability/clean_root.sh          as root: `examples/run.sh --demo` until it has answered one GET, then `tests/run.sh`
#   tests/portability/clean_root.sh --demo   only the first
#   LRT_PORT=8080                            of the demo, if another program has that port
#   LRT_BUILD_SECONDS=3600                   how long the first command may take to serve
#   LRT_DEBIAN_SUITE, LRT_DEBIAN_MIRROR      bookworm, and the mirror of this machine
#
# What is committed is cloned. Mounts and processes are in namespaces of their own and end with the script. Exits with 77 where the rights or the
# tools are missing.
set -euo pipefail

source_root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/../.." && pwd)
what=${1:-all}
if (($# > 1)) || [[ $what != all && $what != --demo ]]; then
  echo "usage: $0 [--demo]" >&2
  exit 2
fi
if [[ $(id -u) != 0 ]]; then
  echo "skipped: debootstrap needs the rights of root"
  exit 77
fi
for tool in debootstrap git unshare; do
  if ! command -v "$tool" >/dev/null; then
    echo "skipped: $tool is not installed"
    exit 77
  fi
done
# shellcheck disable=SC2016  # apt-get expands it
mirror=${LRT_DEBIAN_MIRROR:-$(apt-get indextargets --format '$(SITE)' 2>/dev/null | grep -v security | head -n 1)}
suite=${LRT_DEBIAN_SUITE:-bookworm}
work=$(mktemp -d)
trap 'rm -rf --one-file-system "$work"' EXIT
trap 'exit 1' INT TERM
root=$work/root

debootstrap --variant=minbase "$suite" "$root" "$mirror" >"$work/log" 2>&1 || {
  tail -n 20 "$work/log"
  echo "skipped: debootstrap found no $suite at $mirror (LRT_DEBIAN_MIRROR, LRT_DEBIAN_SUITE)"
  exit 77
}
echo "a root with $suite: $(du -sxh "$root" | cut -f 1)"
git clone --quiet "$source_root" "$root/lrt"
git -C "$root/lrt" log --oneline -1

cat >"$root/in_root.sh" <<'IN_ROOT'
#!/bin/bash
# in_root.sh PORT SECONDS all|--demo
set -euo pipefail
port=$1
limit=$2
what=$3
cd /lrt
log=/demo.log

# Prints the response to GET /baxter. bash asks, because the root has no client.
ask() {
  exec 3<>"/dev/tcp/127.0.0.1/$port" || return 1
  printf 'GET /baxter HTTP/1.1\r\nHost: 127.0.0.1:%s\r\nAccept: text/turtle\r\nConnection: close\r\n\r\n' "$port" >&3
  cat <&3
  exec 3<&-
}
if (ask) 2>/dev/null; then
  echo "another program has port $port; set LRT_PORT"
  exit 1
fi
options=()
if [[ $port != 8080 ]]; then options=(--port "$port"); fi
echo "examples/run.sh --demo ${options[*]}"
examples/run.sh --demo "${options[@]}" >"$log" 2>&1 &
demo=$!
until (ask) >/response 2>/dev/null; do
  if ! kill -0 "$demo" 2>/dev/null || ((SECONDS > limit)); then
    tail -n 40 "$log"
    echo "examples/run.sh --demo did not serve within $SECONDS s"
    exit 1
  fi
  sleep 1
done
head -n 1 /response
if ! head -n 1 /response | grep '^HTTP/1.1 200 ' >/dev/null || ! grep -i '^content-type: text/turtle' /response >/dev/null; then
  cat /response
  exit 1
fi
kill -INT "$demo"
status=0
wait "$demo" || status=$?
tail -n 5 "$log"
if ((status != 0)); then
  echo "examples/run.sh --demo ended with $status"
  exit 1
fi
echo "examples/run.sh --demo: built, served and ended, $SECONDS s"
[[ $what == all ]] || exit 0
tests/run.sh
echo "tests/run.sh: passed, $SECONDS s"
IN_ROOT

# All that is mounted or started ends with these namespaces. Their first process only waits, since signals do not end a process 1 by themselves.
cat >"$work/enter.sh" <<'ENTER'
set -eu
root=$1
shift
mount -t proc proc "$root/proc"
mount --rbind /dev "$root/dev"
chroot "$root" /usr/bin/env -i HOME=/root PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin bash /in_root.sh "$@" &
wait "$!"
ENTER
unshare --mount --pid --fork --kill-child -- bash "$work/enter.sh" "$root" "${LRT_PORT:-8080}" "${LRT_BUILD_SECONDS:-3600}" "$what" &
child=$!
trap 'kill "$child" 2>/dev/null; exit 1' INT TERM
wait "$child"
