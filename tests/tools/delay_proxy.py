# SPDX-License-Identifier: Apache-2.0
"""A proxy in front of a robot that makes each byte late by half a round trip in each direction, and counts requests. A connection costs one round trip,
as over a network. Bytes are only delayed: none is lost, none is reordered, and what was sent together arrives together."""

import asyncio
import re
import threading
import urllib.parse

REQUEST = re.compile(rb"^(GET|HEAD|PUT|POST|DELETE|OPTIONS|PATCH) (\S+) HTTP/1\.1\r$", re.M)


class DelayProxy:
    """url: where to ask. round_trip: in seconds; 0 only counts."""

    def __init__(self, robot_url, round_trip=0.0):
        parts = urllib.parse.urlsplit(robot_url)
        self.target, self.delay = (parts.hostname, parts.port), round_trip / 2
        self.requests, self.lock = [], threading.Lock()
        self.loop = asyncio.new_event_loop()
        ready = threading.Event()

        async def serve():
            self.server = await asyncio.start_server(self.carry, "127.0.0.1", 0)
            self.url = f"http://127.0.0.1:{self.server.sockets[0].getsockname()[1]}/"
            ready.set()

        self.loop.create_task(serve())
        self.thread = threading.Thread(target=self.loop.run_forever, daemon=True)
        self.thread.start()
        assert ready.wait(30)

    def take(self):
        """The requests since the last call: "GET /arm"."""
        with self.lock:
            taken, self.requests = self.requests, []
        return taken

    async def carry(self, reader, writer):
        try:
            robot_reader, robot_writer = await asyncio.open_connection(*self.target)
        except OSError:
            writer.close()
            return
        await asyncio.gather(self.pass_on(reader, robot_writer, 2 * self.delay, self.count), self.pass_on(robot_reader, writer, 0.0, None),
                             return_exceptions=True)

    async def pass_on(self, source, sink, connecting, seen):
        """Reads at once, writes later."""
        queue = asyncio.Queue()
        opened = self.loop.time()

        async def write():
            while True:
                due, data = await queue.get()
                if (rest := due - self.loop.time()) > 0:
                    await asyncio.sleep(rest)
                if not data:
                    break
                sink.write(data)
                await sink.drain()
            sink.close()

        task = self.loop.create_task(write())
        kept = b""
        while True:
            try:
                data = await source.read(65536)
            except OSError:
                data = b""
            now = self.loop.time()
            queue.put_nowait((max(now, opened + connecting) + self.delay, data))
            if not data:
                break
            if seen:
                kept = seen(kept + data)
        await task

    def count(self, data):
        """Counts the request lines, and returns what may be the beginning of one."""
        end = 0
        for match in REQUEST.finditer(data):
            with self.lock:
                self.requests.append(f"{match.group(1).decode()} {match.group(2).decode()}")
            end = match.end()
        return data[max(end, len(data) - 4096):]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        async def end():
            self.server.close()
            tasks = asyncio.all_tasks() - {asyncio.current_task()}
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            self.loop.call_soon(self.loop.stop)

        asyncio.run_coroutine_threadsafe(end(), self.loop)
        self.thread.join(30)
        assert not self.thread.is_alive()
        self.loop.close()
