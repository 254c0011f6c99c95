#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# What subscribers cost: publish() in the control loop with 0, 10 and 1,000 of them, the latency from publish() to a client, messages/s and
# CPU per message, and what a client that does not read does to the others. Bounded in count and time, on loopback.
#
#   tests/bench/subscriptions.sh [BUILD_FOLDER]
#
#   SECONDS_EACH=3 ROUNDS=3
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
build=${1:-$here/build/release}/tests/bench
each=${SECONDS_EACH:-3} rounds=${ROUNDS:-3}

echo "== publish()"
"$build/publish_bench"
"$build/publish_bench" --tick

output=$(mktemp -d)
: > "$output/server"  # it is read before the other process may have opened it
"$build/pushed_server" --publish --keep 64 > "$output/server" &
pid=$!
trap 'kill "$pid" 2>/dev/null || true; rm -rf "$output"' EXIT
port=
for _ in $(seq 100); do
  port=$(sed -nE 's|^listening on http://127.0.0.1:([0-9]+)/.*|\1|p' "$output/server")
  [ -n "$port" ] && break
  sleep 0.1
done
resident() { sed -nE 's/^VmRSS:\s+//p' "/proc/$pid/status"; }
load() { "$build/push_load" --port "$port" --pid "$pid" --seconds "$each" "$@"; }
queue='/arm/joint/angle?queueLength=256'

echo "== memory: resident before, and with 1,000 clients that do not read"
resident
"$build/push_load" --port "$port" --clients 1 --stalled 1000 --seconds 4 > "$output/stalled" &
stalled=$!
sleep 3
resident
wait "$stalled"

echo "== published at 1 kHz to 50 clients: the newest value; every value"
for _ in $(seq "$rounds"); do
  load --clients 50
  load --clients 50 --path "$queue"
done
echo "== to 1, 100 and 1,000 clients; 1,000 ask for more than this machine carries"
for clients in 1 100 1000; do load --clients "$clients" --buffer 16384; done
echo "== 50 clients, and one more that does not read, in turns"
for _ in $(seq "$rounds"); do
  load --clients 50
  load --clients 50 --stalled 1
done
