#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# GET of a pushed property from each of lrt's transports, beside the library it stands on answering the same number of bytes as a constant:
# requests/s, latencies and server CPU, plain and TLS, in alternating pairs; then resident memory per idle connection. On loopback, bounded:
# four minutes at most.
#
#   tests/bench/transports.sh [BUILD_FOLDER]
#
#   ROUNDS=5 REQUESTS=30000 (of a run; a quarter with one connection) CONNECTIONS='1 8 64 256' IDLE=1000 TRANSPORTS=http
#   LIMIT=200 (seconds after which no further pair is begun)
#   PIN=1    the load runs on core 1, the servers, which have one thread at work, on core 0. PIN=0: all as it comes.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
build=${1:-$here/build/release}/tests/bench
rounds=${ROUNDS:-5} requests=${REQUESTS:-30000} idle=${IDLE:-1000} limit=${LIMIT:-200}
read -ra counts <<< "${CONNECTIONS:-1 8 64 256}"
read -ra wanted <<< "${TRANSPORTS:-http}"
pin=${PIN:-1}
(($(nproc) > 1)) || pin=0
path=/arm/joint/angle

output=$(mktemp -d)
pids=()
trap 'kill "${pids[@]}" 2>/dev/null || true; rm -rf "$output"' EXIT
"$here/examples/make-certificate.sh" "$output/tls"
core() {  # number, program and arguments
  local number=$1
  shift
  if ((pin)); then exec taskset -c "$number" "$@"; else exec "$@"; fi
}
start() {  # name, program and arguments: sets port_<name> and pid_<name>
  local name=$1 port=''
  shift
  : > "$output/$name"  # it is read before the other process may have opened it
  (core 0 "$@") > "$output/$name" &
  pids+=($!)
  printf -v "pid_$name" %s $!
  for _ in $(seq 100); do
    port=$(sed -nE 's|^listening on https?://127.0.0.1:([0-9]+)/.*|\1|p' "$output/$name")
    [ -n "$port" ] && break
    sleep 0.1
  done
  [ -n "$port" ] || { echo "$0: $1 does not listen" >&2; exit 1; }
  printf -v "port_$name" %s "$port"
}
stop() {  # name
  local pid=pid_$1
  kill "${!pid}"
  wait "${!pid}" 2>/dev/null || true
}
bytes() {  # name, scheme: of an answer
  local port=port_$1
  curl -s -k -i "$2://127.0.0.1:${!port}$path" | wc -c
}
constant_of() { case $1 in http) echo beast ;; esac; }
scheme_of() { if [ "$1" = tls ]; then echo https; else echo http; fi; }

transports=()
for transport in "${wanted[@]}"; do
  if ! [ -x "$build/$(constant_of "$transport")_constant" ]; then
    echo "$transport: its constant is not built; left out"
  elif "$build/pushed_server" --transport "$transport" --help > "$output/has" 2>&1 || [ $? -ne 3 ]; then
    transports+=("$transport")
  else
    echo "$transport: not in this build; left out"
  fi
done

for transport in "${transports[@]}"; do
  for kind in plain tls; do
    options=()
    [ $kind = tls ] && options=(--tls "$output/tls")
    start "${transport}_$kind" "$build/pushed_server" --transport "$transport" "${options[@]}"
    size=$(bytes "${transport}_$kind" "$(scheme_of $kind)")
    library=$(constant_of "$transport")
    start "${library}_$kind" "$build/${library}_constant" --total "$size" "${options[@]}"
    echo "$transport, $kind: answers of $size bytes; $library: $(bytes "${library}_$kind" "$(scheme_of $kind)")"
  done
done

load() {  # name, kind, connections
  local port=port_$1 pid=pid_$1 options=() count=$requests
  [ "$2" = tls ] && options=(--tls)
  (($3 > 1)) || count=$((requests / 4))
  (core 1 "$build/http_load" --port "${!port}" --pid "${!pid}" --path "$path" --connections "$3" --requests "$count" \
    --warm-up $((count / 10 + $3)) "${options[@]}")
}
for round in $(seq "$rounds"); do
  for transport in "${transports[@]}"; do
    for kind in plain tls; do
      pair=("$transport" "$(constant_of "$transport")")
      ((round % 2)) || pair=("${pair[1]}" "${pair[0]}")
      for connections in "${counts[@]}"; do
        ((SECONDS < limit)) || continue
        for name in "${pair[@]}"; do
          who=constant
          [ "$name" = "$transport" ] && who=lrt
          echo "$transport $kind $connections $who $round: $(load "${name}_$kind" "$kind" "$connections")"
        done
      done
    done
  done
done | tee "$output/rows"

# A process of its own for each: what 256 connections have left behind would hide what 1,000 need. No pipe around it: what a subshell
# starts the trap would not know.
row() {  # words
  echo "$*" | tee -a "$output/idle"
}
for transport in "${transports[@]}"; do
  for kind in plain tls; do
    options=() load=()
    [ $kind = tls ] && options=(--tls "$output/tls") load=(--tls)
    start fresh "$build/pushed_server" --transport "$transport" "${options[@]}"
    pid=pid_fresh port=port_fresh
    row "$transport $kind lrt: $("$build/idle_memory" --port "${!port}" --pid "${!pid}" --path "$path" --connections "$idle" "${load[@]}")"
    stop fresh
    start fresh "$build/$(constant_of "$transport")_constant" --size 1000 "${options[@]}"
    row "$transport $kind constant: $("$build/idle_memory" --port "${!port}" --pid "${!pid}" --path "$path" --connections "$idle" "${load[@]}")"
    stop fresh
  done
done

python3 - "$output/rows" "$output/idle" << 'PY'
import re, statistics, sys

rows, idle = {}, {}
for line in open(sys.argv[1]):
    transport, kind, connections, who, turn = line.split(":")[0].split()
    numbers = re.search(r"([\d.]+)/s, p50 ([\d.]+) us, p99 ([\d.]+) us.*load CPU ([\d.]+).*server CPU ([\d.]+)", line)
    if numbers:
        rows.setdefault((transport, kind, connections), {}).setdefault(turn, {})[who] = [float(n) for n in numbers.groups()]
for line in open(sys.argv[2]):
    transport, kind, who = line.split(":")[0].split()
    each = re.search(r"([\d.-]+) KiB each", line)
    idle.setdefault((transport, kind), {})[who] = each.group(1) if each else "-"

middle = statistics.median
print("\n| transport | connections | requests/s lrt | constant | ratio | p50 us lrt / constant | p99 us lrt / constant | server CPU us lrt / constant | load's core in use |")
print("|---|---|---|---|---|---|---|---|---|")
for (transport, kind, connections), turns in rows.items():
    turns = [t for t in turns.values() if len(t) == 2]
    if not turns:
        continue
    lrt, constant = ([middle(t[who][i] for t in turns) for i in range(5)] for who in ("lrt", "constant"))
    ratios = sorted(t["lrt"][0] / t["constant"][0] for t in turns)
    busy = max(who[0] * who[3] / 1e6 for who in (lrt, constant))
    print(f"| {transport} {kind} | {connections} | {lrt[0]:.0f} | {constant[0]:.0f} | {middle(ratios):.2f} ({ratios[0]:.2f} to {ratios[-1]:.2f}) "
          f"| {lrt[1]:.0f} / {constant[1]:.0f} | {lrt[2]:.0f} / {constant[2]:.0f} | {lrt[4]:.2f} / {constant[4]:.2f} | {100 * busy:.0f} % |")
print("\n| KiB resident per idle connection | lrt | constant |\n|---|---|---|")
for (transport, kind), who in idle.items():
    print(f"| {transport} {kind} | {who.get('lrt', '-')} | {who.get('constant', '-')} |")
PY
