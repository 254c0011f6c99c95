# SPDX-License-Identifier: Apache-2.0
"""A store for tests that has the SPARQL 1.1 Graph Store HTTP Protocol, indirectly identified graphs, and no queries."""

import hashlib
import http.server
import threading
import urllib.parse


class GraphStore:
    """`graphs` has the content, `methods` the methods of all requests. With `tags` the store gives entity tags of the contents."""

    def __init__(self, tags=False):
        store = self
        self.graphs = {}
        self.methods = []
        self.lock = threading.Lock()

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"
            disable_nagle_algorithm = True  # else each body waits 40 ms for the acknowledgement of its header

            def name(self):
                with store.lock:
                    store.methods.append(self.command)
                return urllib.parse.parse_qs(urllib.parse.urlsplit(self.path).query)["graph"][0]

            def tag(self, body):
                return '"' + hashlib.sha256(body).hexdigest() + '"'

            def reply(self, status, body=b"", tag=None):
                self.send_response(status)
                if tags and tag:
                    self.send_header("ETag", tag)
                if status not in (204, 304):
                    self.send_header("Content-Length", str(len(body)))
                    self.send_header("Content-Type", "text/turtle")
                self.end_headers()
                self.wfile.write(body)

            def do_GET(self):
                name = self.name()
                with store.lock:
                    body = store.graphs.get(name)
                if body is None:
                    self.reply(404)
                elif tags and self.headers["If-None-Match"] == self.tag(body):
                    self.reply(304, tag=self.tag(body))
                else:
                    self.reply(200, body, self.tag(body))

            def do_PUT(self):
                name, body = self.name(), self.rfile.read(int(self.headers["Content-Length"]))
                with store.lock:
                    before = store.graphs.get(name)
                    expected = self.headers["If-Match"] if tags else None
                    is_refused = expected and (before is None or expected != self.tag(before))
                    if not is_refused:
                        store.graphs[name] = body
                self.reply(412 if is_refused else 201 if before is None else 204, tag=None if is_refused else self.tag(body))

            def do_DELETE(self):
                name = self.name()
                with store.lock:
                    body = store.graphs.pop(name, None)
                self.reply(404 if body is None else 204)

            def log_message(self, *_):
                pass

        class Server(http.server.ThreadingHTTPServer):
            daemon_threads = True

            def handle_error(self, *_):
                pass  # the other end has gone

        self.server = Server(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_port}/robots/data"
        threading.Thread(target=self.server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.server.shutdown()
        self.server.server_close()

    # What mirror_faults.py does to a store.

    def take_methods(self):
        with self.lock:
            taken, self.methods = self.methods, []
        return taken

    def content(self):
        """A dictionary of texts in Turtle."""
        with self.lock:
            return {name: body.decode() for name, body in self.graphs.items()}

    def empty(self):
        with self.lock:
            self.graphs.clear()

    def delete(self, name):
        with self.lock:
            del self.graphs[name]

    def put(self, name, turtle):
        with self.lock:
            self.graphs[name] = turtle.encode()

    def save(self):
        with self.lock:
            return dict(self.graphs)

    def restore(self, saved):
        with self.lock:
            self.graphs = dict(saved)
