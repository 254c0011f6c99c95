#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Attacks a server in all ways that are kept here, and prints one row of Markdown for each: what was measured, and the seconds that it took. All that the
# attacks print goes to a file, from which the other tables of docs/resilience.md are made.
#
#   tests/attack/run.sh [BUILD [REPORT]]      BUILD: a folder in which the tests are built; default build/dev. REPORT: default BUILD/attacks.md
#
# Takes some minutes. LRT_KILLS, LRT_ATTACK_SECONDS, LRT_ATTACK_FACTOR, LRT_ATTACK_RUNS, LRT_ATTACK_STRIDE, LRT_NUMBER_FORMS and LRT_WORLD_TRIPLES make
# single attacks longer.
set -eu

here=$(cd "$(dirname "$0")" && pwd)
build=$(cd "${1:-$here/../../build/dev}" && pwd)
report=${2:-$build/attacks.md}
output=$report.part
tests=$build/tests
export PYTHONDONTWRITEBYTECODE=1
status=0

# row ATTACK FIGURES COMMAND...   FIGURES: a program for awk that selects them from what the command prints. A program of BUILD that is not there is said.
row() {
  attack=$1 figures=$2
  shift 2
  for word in "$@"; do
    case $word in
      "$build"/*)
        if ! [ -e "$word" ]; then
          printf '| %s | left out: %s is not built | |\n' "$attack" "${word#"$build"/}"
          return
        fi
        ;;
    esac
  done
  begin=$(date +%s) failed=
  # shellcheck disable=SC2016  # a program for awk
  "$@" >"$output" 2>&1 || { status=1 failed='**FAILED** ' figures='/[^ ]/ { last = $0 } END { print substr(last, 1, 300) }'; }
  {
    printf '\n## %s\n\n```\n' "$attack"
    cat "$output"
    printf '```\n'
  } >>"$report"
  # shellcheck disable=SC2016  # a program for awk
  printf '| %s | %s%s | %s |\n' "$attack" "$failed" "$(awk "$figures" "$output" | awk '{ gsub(/\|/, "/"); printf "%s%s", (NR > 1 ? "; " : ""), $0 }')" \
    "$(($(date +%s) - begin))"
}

every='/[^ ]/ && !/^LRT_SEED=/'
checks='/^All tests passed|^test cases:|^assertions:/'
lines_and_checks='/: .*[0-9]/ && !/^(Filters|test cases|assertions|due to|  )/ || /^All tests passed|^test cases:/'
# shellcheck disable=SC2016
bodies='
  / x\), PUT/ {
    split($0, word, ", ")
    way = word[1] ", " word[2]
    if (!(way in ways)) order[++count] = way
    ways[way] = 1
    figures = $0
    sub(/.*p50.p99 ms: /, "", figures)
    split(figures, part, "(")
    for (i = 2; i <= 4; ++i) if (part[i] + 0 > worst[way, i]) worst[way, i] = part[i] + 0
  }
  END { for (n = 1; n <= count; ++n) { way = order[n]; printf "%s: p99 of GET, PUT, stop at most %.1f, %.1f, %.1f times quiet\n", way, worst[way, 2], worst[way, 3], worst[way, 4] } }'
# shellcheck disable=SC2016
lateness='
  BEGIN { FS = "|" }
  NF == 1 && /:$/ { way = substr($0, 1, length($0) - 1); order[++count] = way }
  NF == 9 && $3 ~ /[0-9]\/[0-9]/ {
    split($3, late, "/")
    split($6, cpu, "/")
    ++rows[way]
    if (late[2] + 0 > worst_late[way]) worst_late[way] = late[2] + 0
    if (cpu[3] + 0 > worst_cpu[way]) worst_cpu[way] = cpu[3] + 0
  }
  /^skipped/ { print }
  END { for (n = 1; n <= count; ++n) { way = order[n]; printf "%s, %d attacks: steps late by at most %d us (p99), poll() at most %d us of CPU (p99.9)\n", way, rows[way], worst_late[way], worst_cpu[way] } }'
# shellcheck disable=SC2016
slowest='
  BEGIN { FS = "|" }
  NF == 6 && $4 ~ /^ *[0-9]+ *$/ { ++rows; if ($4 + 0 >= most) { most = $4 + 0; name = $2 "," $3 } }
  END { gsub(/ +/, " ", name); printf "of the %d slowest inputs: %d ns/byte (%s)\n", rows, most, name }'
# shellcheck disable=SC2016
exits='/ runs failed/ { for (i = 1; i <= NF; ++i) if ($i == "of") { failed += $(i - 1); runs += $(i + 1) } } END { printf "%d of %d runs failed\n", failed, runs }'

transports="http"
if grep -qs '^LRT_LIBWEBSOCKETS:BOOL=ON' "$build/CMakeCache.txt"; then transports="http libwebsockets"; fi

title=$(printf '# Attacks, %s, %s CPUs' "$(date -u +%Y-%m-%d)" "$(nproc)")
printf '%s\n' "$title" >"$report"
printf '%s\n\n| attack | measured | s |\n|---|---|---|\n' "$title"

for transport in $transports; do
  row "Large bodies, $transport" "$bodies" python3 "$here/large_bodies.py" "$tests/attack/attacked_robot" --transport "$transport"
done
# shellcheck disable=SC2086  # a list
row "Lateness of a control loop under each attack" "$lateness" env "LRT_ATTACK_SECONDS=${LRT_ATTACK_SECONDS:-3}" \
  python3 "$here/lateness.py" "$tests/attack/attacked_robot" --transport $transports
row "Texts that are expensive for their size; unfinished bodies" "$lines_and_checks" "$tests/test_attack"
row "The worst inputs for each parser" "$slowest" "$tests/attack/worst_inputs"

row "Lexical forms of numbers, times and durations, by server, SPARQL, SHACL, JSON and CBOR: as a reader of big numbers has them" "$checks" \
  env "LRT_NUMBER_FORMS=${LRT_NUMBER_FORMS:-50000}" "$tests/test_query" "[numbers]"
row "The memory of all queries has one limit" "$lines_and_checks" "$tests/test_query" -# "[#memory_test]"
row "Endless queries of one principal beside those of others" "$lines_and_checks" "$tests/test_query" "[fair]"
row "poll() while another thread has the engine" "$checks" "$tests/test_server" "[poll]"
row "1,400 event streams that nobody reads; large requests, in poll()" "/event streams|^\\| longest/" "$tests/bench/poll_steps" --rounds 10
row "Memory runs out once at any place of a request" "$checks" "$tests/attack/test_fail_after"
row "Memory is scarce: 5 to 10 of a thousand allocations fail" "$checks" env "LRT_ATTACK_RUNS=${LRT_ATTACK_RUNS:-10}" "$tests/attack/test_scarce_memory"
row "A system call fails once at any place of a server's life" "/ faults,/ || $checks" "$tests/attack/test_fail_calls" "a system call fails once*"
# shellcheck disable=SC2086  # a list
row "The process ends while clients are served" "$exits" python3 "$here/exit_test.py" "$tests/attack/exit_host" $transports

row "Messages, tags, numbers and counts beside what is hidden: those of a robot without it" "$checks" "$tests/test_engine" "[twins]"
row "The same, of queries" "$checks" "$tests/test_query" "[twins]"
row "Hidden and absent, by each path, method, format and condition, and on each transport" "$checks" "$tests/test_server" -# "[#hidden_test],[#rights_test]"
row "Principals that are signed out, or have ended" "$checks" "$tests/test_server" -# "[#sessions_test]"

row "Killed while callbacks are made and cancelled" "$every" env "LRT_KILLS=${LRT_KILLS:-10}" python3 "$here/kill_test.py" "$build/examples/baxter/baxter"
row "Killed, and on a full disk, while an audit is written" "$every" env "LRT_KILLS=${LRT_KILLS:-10}" \
  python3 "$here/audit_test.py" "$build/examples/baxter/baxter"
row "Killed while a kept graph is written; a full disk" "$every" env "LRT_KILLS=${LRT_KILLS:-10}" \
  python3 "$here/kill_graphs_test.py" "$tests/attack/kept_world" "$tests/attack/libfull_disk.so"
row "Journals that are cut at each byte, have a flipped bit or another version" "$checks" "$tests/test_server" -# "[#journal_test]"
row "A large graph of a World" "/load|write|memory of the World/" "$tests/bench/world_bench" "${LRT_WORLD_TRIPLES:-100000}"

row "Fields that hide others, ClientHellos and stops, on an lws_context" "$lines_and_checks" "$tests/test_transport" "[libwebsockets]"

rm -f "$output"
printf '\nAll that was printed: %s\n' "$report"
exit $status
