# SPDX-License-Identifier: Apache-2.0
"""A store for tests that has the SPARQL 1.1 Graph Store HTTP Protocol, indirectly identified graphs, and no queries."""

import http.server
import threading
import urllib.parse


class GraphStore:
    def __init__(self):
        store = self
        self.graphs = {}
        self.lock = threading.Lock()

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def name(self):
                return urllib.parse.parse_qs(urllib.parse.urlsplit(self.path).query)["graph"][0]

            def reply(self, status, body=b""):
                self.send_response(status)
                if status != 204:
                    self.send_header("Content-Length", str(len(body)))
                    self.send_header("Content-Type", "text/turtle")
                self.end_headers()
                self.wfile.write(body)

            def do_GET(self):
                with store.lock:
                    body = store.graphs.get(self.name())
                self.reply(404) if body is None else self.reply(200, body)

            def do_PUT(self):
                body = self.rfile.read(int(self.headers["Content-Length"]))
                with store.lock:
                    is_new = self.name() not in store.graphs
                    store.graphs[self.name()] = body
                self.reply(201 if is_new else 204)

            def do_DELETE(self):
                with store.lock:
                    body = store.graphs.pop(self.name(), None)
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
