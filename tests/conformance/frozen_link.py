# SPDX-License-Identifier: Apache-2.0
"""A link to a robot that a test can freeze, thaw and cut: a TCP proxy on the loopback interface."""

import selectors
import socket
import threading


class FrozenLink:
    """Forwards bytes to `port`. What arrives on a frozen direction waits, and nothing is lost. `target`: the port of connections to come."""

    def __init__(self, port):
        self.target = port
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self.url = "http://127.0.0.1:%d/" % self.port
        self._wake, self._woken = socket.socketpair()
        self._lock = threading.Lock()
        self._frozen = {"up": False, "down": False}  # to the robot, to its client
        self._cut = self._end = False
        self.connections = 0  # how many were opened
        self.answered = 0  # [bytes] that the robot has sent
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def freeze(self, to_robot=True, to_client=True):
        self._set(lambda: self._frozen.update(up=to_robot, down=to_client))

    def thaw(self):
        self._set(lambda: self._frozen.update(up=False, down=False))

    def cut(self):
        """Ends all connections. New ones are accepted."""
        self._set(lambda: setattr(self, "_cut", True))

    def close(self):
        self._set(lambda: setattr(self, "_end", True))
        self._thread.join()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _set(self, change):
        with self._lock:
            change()
            self._done.clear()
        self._wake.send(b"x")
        self._done.wait()  # what is sent after this call finds the link as it is now

    def _run(self):
        peers, waiting, ended = {}, {}, set()  # socket -> (peer, direction of what it sends); socket -> bytes for it; sockets that have sent their last
        while True:
            with self._lock:
                frozen, cut, end, self._cut = dict(self._frozen), self._cut, self._end, False
                self._done.set()
            if cut or end:
                for each in peers:
                    each.close()
                peers, waiting, ended = {}, {}, set()
            if end:
                self._listener.close()
                return
            with selectors.DefaultSelector() as selector:
                selector.register(self._listener, selectors.EVENT_READ)
                selector.register(self._woken, selectors.EVENT_READ)
                for each, (peer, direction) in peers.items():
                    reads = not frozen[direction] and each not in ended and len(waiting[peer]) < 1 << 16
                    writes = not frozen[peers[peer][1]] and waiting[each]
                    if reads or writes:
                        selector.register(each, selectors.EVENT_READ * reads | selectors.EVENT_WRITE * bool(writes))
                ready = selector.select()
            for key, events in ready:
                each = key.fileobj
                if each is self._woken:
                    each.recv(4096)
                elif each is self._listener:
                    client = each.accept()[0]
                    self.connections += 1
                    try:
                        robot = socket.create_connection(("127.0.0.1", self.target))
                    except OSError:
                        client.close()
                        continue
                    peers.update({client: (robot, "up"), robot: (client, "down")})
                    waiting.update({client: b"", robot: b""})
                elif each in peers:
                    try:
                        self._forward(each, events, peers, waiting, ended)
                    except OSError:
                        self._forget(each, peers, waiting, ended)

    def _forward(self, each, events, peers, waiting, ended):
        peer, direction = peers[each]
        if events & selectors.EVENT_WRITE:
            waiting[each] = waiting[each][each.send(waiting[each]) :]
        if events & selectors.EVENT_READ:
            data = each.recv(1 << 16)
            waiting[peer] += data
            self.answered += len(data) * (direction == "down")
            if not data:
                ended.add(each)
        for one, other in ((each, peer), (peer, each)):
            if other in ended and not waiting[one]:
                one.shutdown(socket.SHUT_WR)
        if each in ended and peer in ended and not waiting[each] and not waiting[peer]:
            self._forget(each, peers, waiting, ended)

    @staticmethod
    def _forget(each, peers, waiting, ended):
        for one in (each, peers[each][0]):
            one.close()
            del peers[one], waiting[one]
            ended.discard(one)
