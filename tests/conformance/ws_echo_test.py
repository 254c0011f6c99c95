#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Runs ws_echo and talks to it with an independent implementation (Debian's python3-websockets).

usage: ws_echo_test.py [--transport NAME] [--tls] PATH_OF_WS_ECHO     exit code 77: the package is missing
"""

import asyncio
import random
import signal
import struct
import subprocess
import sys
import traceback

sys.dont_write_bytecode = True  # nothing is left in the source tree
from robot_process import Way, exceptions, run_on_way
from websocket_frames import frame

try:
    import websockets
    from websockets.exceptions import ConnectionClosed, InvalidStatusCode
    from websockets.frames import Close
except ImportError as missing:
    print(f"skipped: {missing}; apt-get install python3-websockets")
    sys.exit(77)

CASES = []


def case(function):
    CASES.append(function)
    return function


def connect(url, **options):
    return websockets.connect(url, **{"compression": None, "max_size": None, "ping_interval": None, "close_timeout": 10, "ssl": Way.context, **options})


async def raw(url, *parts):
    """Sends bytes behind the handshake of the library; what the library then makes of the answer is the close that it got."""
    async with connect(url) as ws:
        for part in parts:
            ws.transport.write(part)
            await asyncio.sleep(0)
        try:
            while True:
                await asyncio.wait_for(ws.recv(), 10)
        except ConnectionClosed as closed:
            return closed.rcvd


async def http(url, request):
    reader, writer = await Way.streams(int(url.rstrip("/").rsplit(":", 1)[1]))
    writer.write(request.encode())
    answer = await asyncio.wait_for(reader.read(65536), 10)
    writer.close()
    return answer.decode()


@case
async def echoes_text(url):
    async with connect(url) as ws:
        for text in ["", "hello", "\u20ac \U0001f916 \u00e9", "x" * 125, "x" * 126, "x" * 65535, "x" * 65536]:
            await ws.send(text)
            assert await ws.recv() == text


@case
async def echoes_binary(url):
    async with connect(url) as ws:
        for data in [b"", b"\x00\xff", bytes(range(256)) * 300]:
            await ws.send(data)
            assert await ws.recv() == data


@case
async def keeps_the_order_of_many(url):
    async with connect(url) as ws:
        async def send():
            for i in range(5000):
                await ws.send(str(i))
        sending = asyncio.ensure_future(send())
        for i in range(5000):
            assert await ws.recv() == str(i)
        await sending


@case
async def echoes_sixteen_mebibytes(url):
    async with connect(url) as ws:
        data = random.Random(1).randbytes(16 * 1024 * 1024)
        await ws.send(data)
        assert await asyncio.wait_for(ws.recv(), 60) == data


@case
async def assembles_fragments(url):
    async with connect(url) as ws:
        await ws.send(["one ", "", "two ", "three"])
        assert await ws.recv() == "one two three"
        await ws.send([b"\x00"] * 1000)
        assert await ws.recv() == b"\x00" * 1000


@case
async def answers_pings_among_fragments(url):
    async with connect(url) as ws:
        ws.transport.write(frame(1, b"a", fin=False))
        pong = await ws.ping(b"payload")
        await asyncio.wait_for(pong, 10)
        ws.transport.write(frame(0, b"b"))
        assert await ws.recv() == "ab"


@case
async def answers_pings_with_their_payload(url):
    async with connect(url) as ws:
        for payload in [b"", b"\x00\xff", b"p" * 125]:
            await asyncio.wait_for(await ws.ping(payload), 10)


@case
async def ignores_unasked_pongs(url):
    async with connect(url) as ws:
        await ws.pong(b"nobody asked")
        await ws.send("x")
        assert await ws.recv() == "x"


@case
async def echoes_close_codes(url):
    for code in [1000, 1001, 1003, 1007, 1011, 3000, 4999]:
        ws = await connect(url)
        await ws.close(code, "because")
        assert ws.close_code == code, ws.close_code


@case
async def answers_a_close_without_a_code(url):
    assert (await raw(url, frame(8))).code in (1000, 1005)


@case
async def answers_what_came_before_a_close(url):
    async with connect(url) as ws:
        ws.transport.write(frame(1, b"last") + frame(8, struct.pack("!H", 1000)))
        assert await ws.recv() == "last"
        try:
            await ws.recv()
            assert False
        except ConnectionClosed as closed:
            assert closed.rcvd == Close(1000, "")


def closes_with(name, code, *parts):
    async def run(url):
        got = await raw(url, *parts)
        assert got is not None and got.code == code, got
    run.__name__ = name
    CASES.append(run)


closes_with("refuses_unmasked_frames", 1002, frame(1, b"x", mask=False))
for bit in (1, 2, 4):
    closes_with(f"refuses_reserved_bit_{bit}", 1002, frame(1, b"x", rsv=bit))
for opcode in (3, 7, 11, 15):
    closes_with(f"refuses_opcode_{opcode}", 1002, frame(opcode))
closes_with("refuses_a_fragmented_ping", 1002, frame(9, b"x", fin=False))
closes_with("refuses_a_long_ping", 1002, frame(9, b"x" * 126))
closes_with("refuses_a_continuation_of_nothing", 1002, frame(0, b"x"))
closes_with("refuses_a_message_within_another", 1002, frame(1, b"x", fin=False), frame(1, b"x"))
closes_with("refuses_half_a_close_code", 1002, frame(8, b"\x03"))
for code in (0, 999, 1004, 1005, 1006, 1015, 2999):
    closes_with(f"refuses_close_code_{code}", 1002, frame(8, struct.pack("!H", code)))
closes_with("refuses_text_that_is_no_utf8", 1007, frame(1, b"\xce\xba\xe1\xbd\xb9\xed\xa0\x80"))
closes_with("refuses_it_before_the_message_ends", 1007, frame(1, b"\xf4\x90", fin=False))
closes_with("refuses_a_character_that_never_ends", 1007, frame(1, b"\xe2\x82", fin=False), frame(0, b""))
closes_with("refuses_more_than_64_mebibytes", 1009, frame(2, b"x", length=64 * 1024 * 1024 + 1))


@case
async def takes_a_character_in_pieces(url):
    async with connect(url) as ws:
        for i, byte in enumerate("\U0001f916".encode()):
            ws.transport.write(frame(1 if i == 0 else 0, bytes([byte]), fin=i == 3))
        assert await ws.recv() == "\U0001f916"


@case
async def takes_frames_a_byte_at_a_time(url):
    async with connect(url) as ws:
        for byte in frame(1, b"slow") + frame(9, b"ping") + frame(1, b"ly"):
            ws.transport.write(bytes([byte]))
            await asyncio.sleep(0)
        assert await ws.recv() == "slow"
        assert await ws.recv() == "ly"


@case
async def negotiates_no_compression(url):
    async with connect(url, compression="deflate") as ws:
        assert not ws.extensions
        await ws.send("plain")
        assert await ws.recv() == "plain"


@case
async def serves_any_path_and_subprotocol_offers(url):
    async with connect(url + "any/path?accept=x", subprotocols=["a", "b"]) as ws:
        assert ws.subprotocol is None
        assert "Server" not in ws.response_headers and "Date" in ws.response_headers
        await ws.send("x")
        assert await ws.recv() == "x"


@case
async def tells_who_does_not_upgrade(url):
    answer = await http(url, "GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
    assert answer.startswith("HTTP/1.1 426 ") and "\r\nUpgrade: websocket\r\n" in answer, answer
    assert "\r\nConnection: close, Upgrade\r\n" in answer, answer


@case
async def tells_the_version(url):
    answer = await http(url, "GET / HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade, close\r\nUpgrade: websocket\r\n"
                             "Sec-WebSocket-Version: 12\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n")
    assert answer.startswith("HTTP/1.1 426 ") and "\r\nSec-WebSocket-Version: 13\r\n" in answer, answer


@case
async def refuses_a_bad_key(url):
    answer = await http(url, "GET / HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade, close\r\nUpgrade: websocket\r\n"
                             "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: short\r\n\r\n")
    assert answer.startswith("HTTP/1.1 400 "), answer


@case
async def serves_a_hundred_at_once(url):
    async def one(i):
        async with connect(url) as ws:
            for n in range(20):
                await ws.send(f"{i} {n}")
                assert await ws.recv() == f"{i} {n}"
    await asyncio.gather(*(one(i) for i in range(100)))


async def ends_with_1001(url, server):
    async with connect(url) as one, connect(url) as other:
        server.send_signal(signal.SIGTERM)
        for ws in (one, other):
            await ws.wait_closed()
            assert ws.close_code == 1001, ws.close_code


def main(arguments):
    server = subprocess.Popen([arguments[0], "--port", "0", *Way.arguments], stdout=subprocess.PIPE, text=True)
    failed = 0
    known = exceptions("ws_echo")
    try:
        url = server.stdout.readline().split()[-1]
        for run in CASES:
            differs = known.get(run.__name__)
            try:
                asyncio.run(asyncio.wait_for(run(url), 120))
                if differs:
                    failed += 1
                    print(f"FAILED {run.__name__}: it holds, but is said to differ: {differs}")
            except Exception:
                failed += not differs
                print(f"{run.__name__} differs: {differs}" if differs else f"FAILED {run.__name__}")
                if not differs:
                    traceback.print_exc(file=sys.stdout)
        try:
            asyncio.run(asyncio.wait_for(ends_with_1001(url, server), 120))
        except Exception:
            failed += 1
            traceback.print_exc(file=sys.stdout)
    finally:
        server.send_signal(signal.SIGTERM)
        code = server.wait(20)
    print(f"{len(CASES) + 1} cases, {failed} failed; ws_echo ended with {code}")
    return 1 if failed or code else 0


if __name__ == "__main__":
    sys.exit(run_on_way(main, usage="ws_echo_test.py [--transport NAME] [--tls] PATH_OF_WS_ECHO"))
