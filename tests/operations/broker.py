# SPDX-License-Identifier: Apache-2.0
"""A Mosquitto for a test."""

import os
import socket
import subprocess

from robot_process import free_port, until


class Broker:
    """A Mosquitto on a loopback port, for everybody."""

    def __init__(self, program, folder, port=None):
        self.port = port or free_port()
        path = os.path.join(folder, "mosquitto.conf")
        with open(path, "w", encoding="utf-8") as file:
            file.write(f"listener {self.port} 127.0.0.1\nallow_anonymous true\n" + ("user root\n" if os.geteuid() == 0 else ""))
        self.process = subprocess.Popen([program, "-c", path], stderr=subprocess.DEVNULL)
        try:
            until(self.accepts, "mosquitto accepts connections")
        except BaseException:
            self.stop()
            raise

    def accepts(self):
        assert self.process.poll() is None, "mosquitto has ended"
        try:
            socket.create_connection(("127.0.0.1", self.port), 1).close()
            return True
        except OSError:
            return False

    def stop(self):
        self.process.kill()
        self.process.wait(30)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()
