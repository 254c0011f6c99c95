#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# What lrt does to a 1 kHz control loop that polls it in its own thread: how late the loop wakes up, and how long poll() takes, without lrt,
# with it idle, and under load. Every load is put a second time on other processes at the same rate while a loop without lrt runs: on a
# machine with few cores the load itself makes the loop late. Then the longest single steps of poll(). On loopback, bounded: some twenty
# rows of SECONDS_EACH and 4 s.
#
#   tests/bench/host_loop.sh [BUILD_FOLDER]
#
#   SECONDS_EACH=20 BUDGET=200 (us, of poll) WORK=50 (us a step) TRANSPORTS=http FIFO=0 (priority of the loop; 0: an ordinary process)
#
# Fails if the process of the loop had a thread besides its own.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
build=${1:-$here/build/release}/tests/bench
each=${SECONDS_EACH:-20} budget=${BUDGET:-200} work=${WORK:-50} warm=3
read -ra wanted <<< "${TRANSPORTS:-http}"
common=(--seconds "$each" --warm-up "$warm" --budget "$budget" --work "$work")
((${FIFO:-0} > 0)) && common+=(--fifo "$FIFO")

output=$(mktemp -d)
running=()
pid_loop='' port_loop='' port_other='' port_observed=''  # by start and listen
trap 'kill "${running[@]}" 2>/dev/null || true; rm -rf "$output"' EXIT
"$here/examples/make-certificate.sh" "$output/p256"
mkdir "$output/rsa"
openssl req -x509 -newkey rsa:2048 -nodes -keyout "$output/rsa/server-key.pem" -out "$output/rsa/server.pem" -days 30 \
  -subj /CN=localhost 2>/dev/null
tls=(--tls "$output/p256")

start() {  # name, program and arguments: sets pid_<name>
  local name=$1
  shift
  : > "$output/$name"  # it is read before the other process may have opened it
  "$@" > "$output/$name" 2>&1 &
  running+=($!)
  printf -v "pid_$name" %s $!
}
listen() {  # the same for a server: sets port_<name> too
  local port=''
  start "$@"
  for _ in $(seq 100); do
    port=$(sed -nE 's|^listening on https?://127.0.0.1:([0-9]+)/.*|\1|p' "$output/$1")
    [ -n "$port" ] && break
    sleep 0.1
  done
  [ -n "$port" ] || { cat "$output/$1" >&2; exit 1; }
  printf -v "port_$1" %s "$port"
}
stop_all() {  # in the order opposite to that of the start, so that clients end before what they talk to
  local i
  for ((i = ${#running[@]} - 1; i >= 0; --i)); do
    kill "${running[i]}" 2>/dev/null || true
    wait "${running[i]}" 2>/dev/null || true
  done
  running=()
}
measured() {  # waits for the line of the loop
  for _ in $(seq $(((each + warm + 20) * 5))); do
    grep -q '^late' "$output/loop" && return
    kill -0 "$pid_loop" 2>/dev/null || break
    sleep 0.2
  done
  grep -q '^late' "$output/loop" || { cat "$output/loop" >&2; exit 1; }
}
failed=0
row() {  # what
  local line rates=()
  line=$(grep '^late' "$output/loop")
  for name in http write post push; do
    [ -f "$output/$name" ] || continue
    rates+=("$(sed -nE 's/.* ([0-9]+)\/s, p50.*, ([0-9]+) not 2xx.*/\1 requests\/s, \2 not 2xx/p; s/.* ([0-9]+ messages\/s).*/\1/p' "$output/$name" | head -1)")
    grep -qE '/s' "$output/$name" || { echo "$1: $name: $(cat "$output/$name")" >&2; failed=1; }
    rm "$output/$name"
  done
  echo "$1: $line; ${rates[*]}" | tee -a "$output/rows"
  if [[ $line != *' 1 threads'* ]]; then
    echo "$1: the loop's process has other threads" >&2
    failed=1
  fi
}
rate() { sed -nE 's/.* ([0-9]+)\/s, p50.*/\1/p' "$output/$1"; }

body='@prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> . @prefix qudt: <http://qudt.org/schema/qudt/> .
@prefix unit: <http://qudt.org/vocab/unit/> . <> vom:numericalValue 0.5 ; qudt:hasUnit unit:RAD .'
argument='@prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> . <> vom:numericalValue 0.5 .'

load() {  # kind, port, rate or 0, further rate or 0: starts clients
  local http=("$build/http_load" --port "$2" --seconds 1000)
  case $1 in
    get) start http "${http[@]}" --path /arm/p% --spread 40 --connections 64 --rate "$3" ;;
    get-tls) start http "${http[@]}" --path /arm/p% --spread 40 --connections 64 --rate "$3" --tls ;;
    handshakes) start http "${http[@]}" --path /arm/p1 --connections 8 --reconnect --rate "$3" --tls ;;
    writes)
      start write "${http[@]}" --path /arm/target --connections 8 --put "$body" --rate "$3"
      start post "${http[@]}" --path /arm/actions/move --connections 8 --post "$argument" --rate "$4"
      ;;
  esac
}
beside() {  # kind, transport: with lrt in the loop, then a loop without it beside the same load on others
  local options=() observers=() constant=("$build/epoll_constant") first=0 second=0 messages=0
  case $1 in get-tls | handshakes) options=("${tls[@]}") observers=(--tls) ;; esac
  if ((${#options[@]})) && [ -x "$build/beast_constant" ]; then constant=("$build/beast_constant" "${tls[@]}"); fi
  listen loop "$build/host_loop" --transport "$2" "${common[@]}" "${options[@]}"
  load "$1" "$port_loop" 0 0
  case $1 in get*) start push "$build/push_load" --port "$port_loop" --path /arm/p1 --clients 10 --seconds 1000 "${observers[@]}" ;; esac
  measured
  stop_all
  case $1 in
    writes) first=$(rate write) second=$(rate post) ;;
    get*) first=$(rate http) messages=$(sed -nE 's/.* ([0-9]+) messages\/s.*/\1/p' "$output/push") ;;
    *) first=$(rate http) ;;
  esac
  row "$2, $1"

  if ((${#options[@]})) && ! [ -x "$build/beast_constant" ]; then return; fi
  listen other "${constant[@]}"
  load "$1" "$port_other" "${first:-1}" "${second:-1}"
  case $1 in
    get*)
      listen observed "$build/pushed_server" --publish --period $((10000000 / (messages > 0 ? messages : 1))) --transport "$2" "${options[@]}"
      start push "$build/push_load" --port "$port_observed" --clients 10 --seconds 1000 "${observers[@]}"
      ;;
  esac
  start loop "$build/host_loop" --without "${common[@]}"
  measured
  stop_all
  row "without lrt, beside $2, $1"
}

start loop "$build/host_loop" --without "${common[@]}"
measured
stop_all
row "without lrt, alone"
transports=()
for transport in "${wanted[@]}"; do
  if "$build/host_loop" --transport "$transport" --help > "$output/has" 2>&1 || [ $? -ne 3 ]; then transports+=("$transport")
  else echo "$transport: not in this build; left out"; fi
done
for transport in "${transports[@]}"; do
  listen loop "$build/host_loop" --transport "$transport" "${common[@]}"
  measured
  stop_all
  row "$transport, idle"
  for kind in get get-tls handshakes writes; do beside "$kind" "$transport"; done
done

python3 - "$output/rows" << 'PY'
import re, sys

rows = []
for line in open(sys.argv[1]):
    what, rest = line.split(": ", 1)
    late = re.search(r"late ([\d. -]+) poll", rest).group(1).split()
    poll = re.search(r"poll ([\d. -]+) cpu", rest).group(1).split()
    cpu = re.search(r"cpu ([\d. -]+) us", rest).group(1).split()
    rows.append((what, late, poll, cpu, rest.split("; ", 1)[1].strip()))
reference = {what: float(late[2]) for what, late, *_ in rows}
alone = reference["without lrt, alone"]
print("\n| us | late 50 % | 99 % | 99.9 % | max | 99.9 % more than alone | than beside the same load | poll() 50 % | 99 % | 99.9 % | max | on a CPU 99.9 % | max | load |")
print("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|")
for what, late, poll, cpu, load in rows:
    beside = reference.get("without lrt, beside " + what)
    poll = poll + cpu[2:] if len(poll) == 4 else ["-"] * 6
    more = f"{float(late[2]) - beside:+.0f}" if beside is not None else "-"
    print(f"| {what} | {' | '.join(late)} | {float(late[2]) - alone:+.0f} | {more} | {' | '.join(poll)} | {load} |")
print()
PY
for transport in "${transports[@]}"; do
  echo "$transport:"
  "$build/poll_steps" --transport "$transport" --budget "$budget" --p256 "$output/p256" --rsa "$output/rsa"
done
exit $failed
