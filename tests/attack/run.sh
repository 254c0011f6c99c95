#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Attacks a server in all ways that are kept here and prints what was measured, as Markdown: the figures of docs/resilience.md.
#
#   tests/attack/run.sh [BUILD]      BUILD: a folder in which the tests are built; default build/dev
#
# Takes some minutes. LRT_KILLS, LRT_ATTACK_SECONDS, LRT_ATTACK_FACTOR, LRT_ATTACK_RUNS and LRT_ATTACK_STRIDE make single attacks longer.
set -eu

here=$(cd "$(dirname "$0")" && pwd)
build=$(cd "${1:-$here/../../build/dev}" && pwd)
export PYTHONDONTWRITEBYTECODE=1
status=0

# section TITLE COMMAND...
section() {
  printf '\n## %s\n\n```\n' "$1"
  shift
  "$@" 2>&1 || { status=1; echo "FAILED"; }
  printf '```\n'
}

transports="http"
if grep -qs '^LRT_LIBWEBSOCKETS:BOOL=ON' "$build/CMakeCache.txt"; then transports="http libwebsockets"; fi

printf '# Attacks, %s, %s CPUs\n' "$(date -u +%Y-%m-%d)" "$(nproc)"
for transport in $transports; do
  section "Large bodies, $transport" python3 "$here/large_bodies.py" "$build/tests/attack/attacked_robot" --transport "$transport"
done
# shellcheck disable=SC2086  # a list
section "Lateness of a control loop under each attack" env "LRT_ATTACK_SECONDS=${LRT_ATTACK_SECONDS:-3}" \
  python3 "$here/lateness.py" "$build/tests/attack/attacked_robot" --transport $transports
section "Texts that are expensive for their size; unfinished bodies" "$build/tests/test_attack"
section "The worst inputs for each parser" "$build/tests/attack/worst_inputs"
section "Memory runs out once at any place of a request" "$build/tests/attack/test_fail_after"
section "Memory is scarce: 5 to 10 of a thousand allocations fail" env "LRT_ATTACK_RUNS=${LRT_ATTACK_RUNS:-10}" "$build/tests/attack/test_scarce_memory"
section "A system call fails once at any place of a server's life" "$build/tests/attack/test_fail_calls" "a system call fails once*"
# shellcheck disable=SC2086  # a list
section "The process ends while clients are served" python3 "$here/exit_test.py" "$build/tests/attack/exit_host" $transports
section "Killed while callbacks are made and cancelled" env "LRT_KILLS=${LRT_KILLS:-10}" python3 "$here/kill_test.py" "$build/examples/baxter/baxter"
section "Killed, and on a full disk, while an audit is written" env "LRT_KILLS=${LRT_KILLS:-10}" python3 "$here/audit_test.py" "$build/examples/baxter/baxter"
section "Killed while a kept graph is written; a full disk" env "LRT_KILLS=${LRT_KILLS:-10}" \
  python3 "$here/kill_graphs_test.py" "$build/tests/attack/kept_world" "$build/tests/attack/libfull_disk.so"
exit $status
