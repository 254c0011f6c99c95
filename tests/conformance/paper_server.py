#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A Linked Robotic Thing server (one arm, two joints), written from the text of the paper alone. R0.9 etc. are its requirements."""
import argparse, base64, hashlib, json, os, queue, re, signal, sys, threading, time, traceback, urllib.request, uuid
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import urlsplit
W3, ARVIDA = "http://www.w3.org/", "http://vocab.arvida.de/2015/06/"    # the figures have prefix names but no IRIs for them
PREFIXES = {"rdf": W3 + "1999/02/22-rdf-syntax-ns#", "rdfs": W3 + "2000/01/rdf-schema#", "xsd": W3 + "2001/XMLSchema#",
    "sh": W3 + "ns/shacl#", "ldp": W3 + "ns/ldp#", "dcterms": "http://purl.org/dc/terms/", "http-core": W3 + "2011/http#",
    "http-methods": W3 + "2011/http-methods#", "vom": ARVIDA + "vom#", "maths": ARVIDA + "maths#", "spatial": ARVIDA + "spatial#",
    "hybrit": "http://example.org/hybrit#", "ros": "http://example.org/ros#", "ex": "http://example.org/paper-server#"}
MEDIA = ("text/turtle", "application/ld+json", "application/json")      # the first one is the default (R1.2)
LOCK, RESOURCES, SUBSCRIPTIONS, BASE = threading.RLock(), {}, {}, ""    # path -> Resource, path -> Subscription
many = lambda value: value if isinstance(value, list) else [value]
refs = lambda *iris: [{"@id": iri} for iri in iris]
expand = lambda name, names=PREFIXES: name[1:-1] if name[0] == "<" else re.sub("^([^:]*):", lambda m: names.get(m[1], m[0]), name)
def scalar(x, unit): return {"@type": "maths:Scalar", "vom:numericalValue": {"@value": round(x, 6), "@type": "xsd:float"}, "vom:unit": refs(unit)}
class Problem(Exception): status, headers = property(lambda p: p.args[0]), property(lambda p: p.args[2] if len(p.args) > 2 else {})

def turtle(v):                                                          # a JSON-LD value as Turtle
    iri = lambda s: s if s.split(":")[0] in PREFIXES else f"<{s}>"
    if not isinstance(v, dict): return json.dumps(v, ensure_ascii=False)
    if "@value" in v: return f'"{v["@value"]}"^^{v["@type"]}'
    if set(v) == {"@id"}: return iri(v["@id"])
    pairs = " ;\n  ".join("a " + ", ".join(many(o)) if k == "@type" else f"{k} " + ", ".join(map(turtle, many(o)))
                          for k, o in v.items() if k != "@id" and o != [])
    return f"{iri(v['@id'])} {pairs} .\n" if "@id" in v else f"[ {pairs} ]"

TERM = r'(?:<[^<>"\s]*>|"[^"\\\n]*"(?:\^\^[^\s;,]+)?|[A-Za-z_][\w-]*:[\w-]*|[-+]?[\d.]+(?:[eE][-+]?\d+)?|a(?=\s)|\[\s*\])'
PAIR = rf'({TERM})\s+({TERM}(?:\s*,\s*{TERM})*)'
FLAT = re.compile(rf'\s*(?:@?(?:prefix|base|PREFIX|BASE)\b[^<>]*<[^<>]*>\s*\.?\s*)*{TERM}\s+({PAIR}(?:\s*;\s*{PAIR})*)\s*;?\s*\.\s*')
def read_pairs(text, media):                                            # one flat subject, as in Figure 5b: {predicate: [object]}
    if media == "text/turtle":
        names = {**PREFIXES, **dict(re.findall(r"(?i)prefix\s+([\w-]*):\s*<([^<>]*)>", text))}
        return {expand(p, names): re.findall(TERM, o) for p, o in re.findall(PAIR, FLAT.fullmatch(text)[1])}, names
    plain = lambda o: f'"{o["@value"]}"' if "@value" in o else o["@id"]
    return {expand(k): [plain(o) if isinstance(o, dict) else str(o) for o in many(v)] for k, v in json.loads(text).items() if k and k[0] != "@"}, PREFIXES
def read_scalar(body, media, unit, low, high):                          # 5.4: validate the input, ignore additional triples
    if media not in MEDIA: raise Problem(415, "send " + ", ".join(MEDIA))
    try:
        pairs, names = read_pairs(body.decode(), media)
        (number,), (given,) = pairs[expand("vom:numericalValue")], pairs[expand("vom:unit")]
        if expand(given, names) == expand(unit) and low <= (x := float(re.sub(r'^"([^"]*)".*', r"\1", number))) <= high: return x
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError): pass
    raise Problem(400, f"needs one vom:numericalValue from {low} to {high} and one vom:unit {unit}")    # R0.6

class Resource:                                                         # R0.3: one URI, its description, what it permits
    def __init__(self, path, parent, describe, **changes):
        self.path, self.parent, self.describe, self.changes = path, parent, describe, changes
        RESOURCES[path] = self
    def children(self): return [r.path for r in RESOURCES.values() if r.parent == self.path]
    def headers(self):                                                  # R0.9 and R0.10
        links = ", ".join(f'<{p}>; rel="related"' for p in self.children())
        return {"Allow": ", ".join(["GET", "HEAD", "OPTIONS", *self.changes]), **({"Link": links} if links else {})}
    def render(self, media):
        nodes = [{"@id": self.path, **self.describe()}] + [{"@id": p, **RESOURCES[p].describe()} for p in self.children() if p in SUBSCRIPTIONS]
        if media != MEDIA[0]: return json.dumps({"@context": {**PREFIXES, "@base": BASE}, **(nodes[0] if len(nodes) == 1 else {"@graph": nodes})}).encode()
        return "".join([f"@base <{BASE}> .\n", *(f"@prefix {p}: <{i}> .\n" for p, i in PREFIXES.items()), *map(turtle, nodes)]).encode()
    def etag(self, media): return '"%s"' % hashlib.sha1(media.encode() + self.render(media)).hexdigest()[:16]   # R0.11

def negotiate(accept):                                                  # R1.2, R0.17
    wanted = {p.split(";")[0].strip(): float((re.search(r";\s*q=([01](\.\d+)?)", p) or "11")[1]) for p in accept.lower().split(",")}
    score = lambda m: next((wanted[r] for r in (m, m.split("/")[0] + "/*", "*/*") if r in wanted), 0)
    if not score(best := max(MEDIA, key=score)): raise Problem(406, "offered: " + ", ".join(MEDIA))
    return best

class Subscription:                                                     # 5.3, Figure 4: listed, described and cancelled by DELETE
    def __init__(self, resource, media, kind, url=None):
        self.resource, self.media, self.kind, self.url, self.id, self.queue = resource, media, kind, url, str(uuid.uuid4()), queue.Queue()
        self.path = f"{resource.parent}/subscriptions/{self.id}"
        Resource(self.path, f"{resource.parent}/subscriptions", self.describe, DELETE=self.cancel)
        SUBSCRIPTIONS[self.path] = self
    def describe(self):
        url = {"hybrit:callbackURL": {"@value": self.url, "@type": "xsd:anyURI"}} if self.url else {}
        return {"@type": ["hybrit:Subscription", self.kind], "hybrit:onResource": refs(self.resource.path), **url,
                "hybrit:mediaType": self.media, "dcterms:identifier": self.id}
    def notify(self): self.queue.put(self.resource.render(self.media))
    def cancel(self, *_):
        with LOCK: RESOURCES.pop(self.path, None); SUBSCRIPTIONS.pop(self.path, None)
        self.queue.put(None)
    def deliver(self, send):                                            # one thread for each subscription keeps the order
        while (body := self.queue.get()) is not None:
            try: send(body)
            except Exception as problem: print("not delivered:", self.path, problem, file=sys.stderr)
    def post(self, body):                                               # R0.13: POST the new representation to the callback URL
        urllib.request.urlopen(urllib.request.Request(self.url, body, {"Content-Type": self.media}), timeout=3).close()

class Joint:
    def __init__(self, path):
        self.path, self.angle, self.limit, self.current = path, 0.0, 25.0, None
        Resource(path, "/", self.describe)
        Resource(path + "/position", path, lambda: {"@type": ["hybrit:Property", "spatial:AxisAngle", "spatial:Rotation3D"],      # Figure 3
            "rdfs:seeAlso": refs(path), "spatial:rotationAngle": scalar(self.angle, "maths:Radian")})
        Resource(path + "/speedLimit", path, lambda: {"rdfs:seeAlso": refs(path), **scalar(self.limit, "ex:RadianPerSecond"),
            "@type": ["hybrit:Property", "maths:Scalar"]}, PUT=self.set_limit)
        Resource(path + "/turn", path, self.describe_turn, POST=self.turn)
        Resource(path + "/blueprint", path, lambda: {"@type": "sh:NodeShape", "sh:targetClass": refs("ros:RevoluteJoint"), "sh:property": [   # Figure 2a
            {"sh:path": refs(p), "sh:minCount": 1, "sh:maxCount": 1} for p in ("ros:rotation", "ex:speedLimit", "hybrit:subscriptions")]})
        container(path)
    def describe(self):                                                 # Figure 2b, R1.3, R1.8-R1.11
        at = lambda *names: refs(*(f"{self.path}/{n}" for n in names))
        return {"@type": ["hybrit:RoboticThing", "ros:RevoluteJoint"], "dcterms:title": self.path[1:], "hybrit:blueprint": at("blueprint"),
                "hybrit:subscriptions": at("subscriptions"), "hybrit:action": at("turn"), "hybrit:property": at("position", "speedLimit"),
                "ros:rotation": at("position"), "ex:speedLimit": at("speedLimit"), "rdfs:seeAlso": refs("/")}
    def describe_turn(self):                                            # Figure 5a, but with POST as in Figure 5b
        one = {"sh:minCount": 1, "sh:maxCount": 1}
        return {"@type": ["hybrit:Action", "hybrit:AsynchronousAction"], "hybrit:consumes": {"@type": "sh:NodeShape", "sh:targetClass": refs("maths:Scalar"), "sh:property": [
            {"sh:path": refs("vom:numericalValue"), **one, "sh:minInclusive": -3.14, "sh:maxInclusive": 3.14}, {"sh:path": refs("vom:unit"), **one, "sh:hasValue": refs("maths:Radian")}]},
            "hybrit:produces": {"@type": "sh:NodeShape", "sh:targetClass": refs("ex:Invocation")}, "hybrit:binding": {"@type": "http-core:Request",
            "http-core:mthd": refs("http-methods:POST"), "http-core:requestURI": refs(self.path + "/turn")}}
    def set_limit(self, body, media):
        self.limit = read_scalar(body, media, "ex:RadianPerSecond", 0.01, 25.0)
        changed(self.path + "/speedLimit")
    def turn(self, body, media):                                        # the invocation becomes a resource (R0.5, R0.8)
        run = {"@type": "ex:Invocation", "ex:status": "running", "ex:target": scalar(read_scalar(body, media, "maths:Radian", -3.14, 3.14), "maths:Radian")}
        path = f"{self.path}/turn/{uuid.uuid4()}"
        def remove(*_): run["ex:status"] = "cancelled"; del RESOURCES[path]
        if self.current and self.current["ex:status"] == "running": self.current["ex:status"] = "cancelled"     # the newest turn wins
        self.current = run
        Resource(path, self.path + "/turn", lambda: run, DELETE=remove)
        threading.Thread(target=self.move, args=(run,), daemon=True).start()
        return path
    def move(self, run):
        start, end = self.angle, run["ex:target"]["vom:numericalValue"]["@value"]
        pause = max(0.3, abs(end - start) / self.limit) / 6
        for step in range(1, 7):
            time.sleep(pause)
            with LOCK:
                if run["ex:status"] != "running": return
                self.angle = start + (end - start) * step / 6
                if step == 6: run["ex:status"] = "done"
                changed(self.path + "/position")

def changed(path): [s.notify() for s in list(SUBSCRIPTIONS.values()) if s.resource.path == path]
def container(thing):                                                   # R1.8
    path = thing.rstrip("/") + "/subscriptions"
    Resource(path, thing, lambda: {"@type": "ldp:Container", "ldp:contains": refs(*RESOURCES[path].children())})

class Handler(BaseHTTPRequestHandler):
    protocol_version, timeout, log_message = "HTTP/1.1", 60, lambda *_: None                            # R0.1
    def reply(self, status, headers=(), body=b""):
        self.send_response(status)
        if status not in (101, 204, 304): headers = {**dict(headers), "Content-Length": str(len(body))}
        for name, value in dict(headers).items(): self.send_header(name, value)
        self.end_headers()
        if self.command != "HEAD": self.wfile.write(body)
    def dispatch(self):
        try:
            try: self.reply(*self.answer())
            except Problem as p: self.reply(p.status, {"Content-Type": "text/plain", **p.headers}, f"{p.args[1]}\n".encode())
            except OSError: raise
            except Exception: traceback.print_exc(); self.reply(500)                                    # R0.6
            if getattr(self, "socket", None): self.websocket(self.socket)
        except OSError: self.close_connection = True
    do_GET = do_HEAD = do_PUT = do_POST = do_DELETE = do_OPTIONS = do_PATCH = dispatch
    def answer(self):
        length, ask = self.headers.get("Content-Length", "0"), self.headers.get
        if "Transfer-Encoding" in self.headers or not re.fullmatch(r"\d{1,5}", length):
            self.close_connection = True
            raise Problem(411, "send a Content-Length below 100000", {"Connection": "close"})
        body = self.rfile.read(int(length))
        if self.request_version == "HTTP/1.1" and "Host" not in self.headers: raise Problem(400, "no Host header")
        with LOCK:
            resource = RESOURCES.get(urlsplit(self.path).path)
            if not resource: raise Problem(404, "no such resource")
            headers = resource.headers()
            if self.command not in headers["Allow"].split(", "): raise Problem(405, "not permitted here", headers)
            if self.command == "OPTIONS": return 204, headers
            tags = {m: resource.etag(m) for m in MEDIA}
            listed = lambda name, tag: ask(name, "").strip() == "*" or tag in re.findall(r'"[^"]*"', ask(name, ""))
            if "If-Match" in self.headers and not any(listed("If-Match", t) for t in tags.values()): raise Problem(412, "it has changed")
            if self.command in ("GET", "HEAD"):
                media = negotiate(", ".join(self.headers.get_all("Accept", ["*/*"])))
                upgrade = ask("Upgrade", "").lower().strip() if "upgrade" in ask("Connection", "").lower() else ""
                if upgrade in ("websocket", "callback") and self.command == "GET" and resource.path.endswith(("/position", "/speedLimit")):
                    return self.subscribe(resource, media, upgrade)                                     # R0.14
                headers.update({"ETag": tags[media], "Vary": "Accept", "Cache-Control": "no-cache"})
                if listed("If-None-Match", tags[media]): return 304, headers
                return 200, {**headers, "Content-Type": media}, resource.render(media)
            if any(listed("If-None-Match", t) for t in tags.values()): raise Problem(412, "it exists")
            location = resource.changes[self.command](body, ask("Content-Type", "").split(";")[0].strip().lower())
            return 204, {"Location": location} if location else {}                                      # R0.7, R0.8
    def subscribe(self, resource, media, upgrade):
        if upgrade == "callback":                                                                       # R0.16
            url = self.headers.get("Callback", "")
            if not re.fullmatch(r"https?://[\w.\[\]:-]+(/[!#-;=?-Z_a-z~]*)?", url): raise Problem(400, "Callback must be an http(s) URL")
            new = Subscription(resource, media, "hybrit:WebCallback", url)
            threading.Thread(target=new.deliver, args=(new.post,), daemon=True).start()
            return 204, {"Location": new.path}             # the paper names no status for it: as for POST
        key = self.headers.get("Sec-WebSocket-Key", "").strip()                                         # R0.12, R0.15
        if self.headers.get("Sec-WebSocket-Version") != "13": raise Problem(426, "version 13", {"Sec-WebSocket-Version": "13", "Upgrade": "websocket", "Connection": "Upgrade"})
        if not re.fullmatch(r"[A-Za-z0-9+/]{22}==", key): raise Problem(400, "bad Sec-WebSocket-Key")
        self.socket = Subscription(resource, media, "ex:WebSocket")
        self.socket.notify()                                                                            # first the present state
        accept = base64.b64encode(hashlib.sha1((key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest()).decode()
        return 101, {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Accept": accept}
    def frame(self, opcode, data):                                                                      # RFC 6455, section 5.2
        size = bytes([len(data)]) if len(data) < 126 else b"\x7e" + len(data).to_bytes(2, "big")
        with self.lock: self.wfile.write(bytes([0x80 | opcode]) + size + data)
    def websocket(self, subscription):
        self.close_connection, self.lock = True, threading.Lock()
        self.connection.settimeout(None)
        def writer():
            subscription.deliver(lambda text: self.frame(1, text))
            try: self.frame(8, (1000).to_bytes(2, "big"))                                               # cancelled by DELETE
            except (OSError, ValueError): pass
        threading.Thread(target=writer, daemon=True).start()
        try:
            while len(head := self.rfile.read(2)) == 2:
                opcode, size = head[0] & 15, head[1] & 127
                if head[1] < 128 or size > 125: return self.frame(8, (1002 if head[1] < 128 else 1009).to_bytes(2, "big"))
                mask, data = self.rfile.read(4), self.rfile.read(size)
                data = bytes(b ^ mask[i % 4] for i, b in enumerate(data))
                if opcode == 8: return self.frame(8, data[:2])
                if opcode == 9: self.frame(10, data)
        finally: subscription.cancel()

def main():
    global BASE
    options = argparse.ArgumentParser()
    options.add_argument("--port", type=int, default=0)
    server = ThreadingHTTPServer(("127.0.0.1", options.parse_args().port), Handler)
    BASE = f"http://127.0.0.1:{server.server_port}/"
    Resource("/", None, lambda: {"@type": ["hybrit:RoboticThing", "ex:RobotArm"], "dcterms:title": "arm", "hybrit:subscriptions": refs("/subscriptions"),
                                 "ex:joint": refs("/joint1", "/joint2")})                               # R0.4
    container("/"); Joint("/joint1"); Joint("/joint2")
    stop = lambda *_: threading.Thread(target=server.shutdown, daemon=True).start()
    signal.signal(signal.SIGTERM, stop)
    threading.Thread(target=lambda: (all(iter(lambda: os.read(0, 4096), b"")), stop()), daemon=True).start()
    print(BASE, flush=True)
    server.serve_forever()
if __name__ == "__main__": main()
