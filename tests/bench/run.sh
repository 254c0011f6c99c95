#!/usr/bin/env bash
# GET of a pushed property over the socket, beside a bare epoll program that answers the same bytes as a constant: server CPU per
# request, in alternating pairs. Bounded: ROUNDS rounds of REQUESTS requests on loopback.
#
#   tests/bench/run.sh [BUILD_FOLDER]
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
build=${1:-$here/build/release}/tests/bench
rounds=${ROUNDS:-5} requests=${REQUESTS:-100000}

pids=()
trap 'kill "${pids[@]}" 2>/dev/null || true' EXIT
output=$(mktemp -d)
start() {  # name, program and arguments: sets port_<name> and pid_<name>
  local name=$1
  shift
  : > "$output/$name"  # it is read before the other process may have opened it
  "$@" > "$output/$name" &
  pids+=($!)
  printf -v "pid_$name" %s $!
  local port=
  for _ in $(seq 100); do
    port=$(sed -nE 's|^listening on http://127.0.0.1:([0-9]+)/.*|\1|p' "$output/$name")
    [ -n "$port" ] && break
    sleep 0.1
  done
  printf -v "port_$name" %s "$port"
}
load() {
  local path=/arm/joint/angle spread=1
  [ "$4" = few ] && path=/thing%/angle spread=9
  [ "$4" = many ] && path=/thing%/angle spread=9999
  "$build/http_load" --port "$1" --pid "$2" --path "$path" --spread "$spread" --connections "$3" --requests "$requests"
}
cpu() { sed -nE 's/.*server CPU ([0-9.]+) us.*/\1/p' <<< "$1"; }

start quiet "$build/pushed_server"
start moving "$build/pushed_server" --publish
start few "$build/pushed_server" --things 10
start many "$build/pushed_server" --things 10000
port=port_quiet
size=$(curl -s -i "http://127.0.0.1:${!port}/arm/joint/angle" | wc -c)
start constant "$build/epoll_constant" --total "$size"
for name in few many; do port=port_$name pid=pid_$name; load "${!port}" "${!pid}" 8 "$name" > "$output/warm"; done  # render each once
echo "answers of $size bytes, $requests requests a run, CPU of the server per GET in us"
for connections in 1 8 64; do
  for _ in $(seq "$rounds"); do
    row="$connections connections:"
    for name in constant quiet moving few many; do
      port=port_$name pid=pid_$name
      row+=" $name $(cpu "$(load "${!port}" "${!pid}" "$connections" "$name")")"
    done
    echo "$row"
  done
done | tee "$output/rows"
python3 - "$output/rows" << 'PY'
import re, statistics, sys
rows = {}
for line in open(sys.argv[1]):
    head, rest = line.split(":")
    values = dict(re.findall(r"(\w+) ([0-9.]+)", rest))
    rows.setdefault(head, []).append({k: float(v) for k, v in values.items()})
for head, runs in rows.items():
    ratio = lambda a, b: statistics.median(r[a] / r[b] for r in runs)
    print(f"{head}: median of ratios to the constant: quiet {ratio('quiet','constant'):.2f}, published at 1 kHz "
          f"{ratio('moving','constant'):.2f}; 10,000 things to 10: {ratio('many','few'):.2f}")
PY
