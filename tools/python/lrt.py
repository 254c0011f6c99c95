# SPDX-License-Identifier: Apache-2.0
"""Use a robot of lrt from Python. One file, the standard library only, Python 3.9 or newer.

    import lrt

    robot = lrt.open("http://127.0.0.1:8080/")
    joint = robot["right_s1"]
    print(joint.read("position", "deg"))               # a number, converted
    joint.write("friction", 0.5)
    joint.invoke("rotate", 20, "deg").wait(10)         # waits until the motion has ended
    for change in joint.watch("position", "deg"):      # until the loop is left
        print(change)                                  # Value(...), or Gap(...) where changes are missing

Names are those that people write: a title, the last part of the address, or several parts, "baxter/right_s1". A value is what JSON
has for it. `Robot`, `Thing` and `Run` may be used from several threads.

A command (`write`, `invoke`, `create`) carries until when it is worth carrying out: `valid_for` seconds from now, 2 by default, by the robot's
clock. It is sent once. If no answer arrives in this time, `Unconfirmed` is raised: it may have been carried out, and it will not be later. A stop
and a cancel do not expire.
"""

import asyncio
import collections
import difflib
import http.client
import json
import os
import random
import re
import socket
import ssl
import threading
import time
import urllib.parse

__all__ = """open Robot Thing Run Value Gap
    Error NotFound NotReached Unconfirmed Refused Late Stopped Controlled Failed""".split()

MAX_BODY = 16 << 20  # [bytes] of a response; of an event
TERMS = "https://w3id.org/lrt/ns#"


class Error(Exception):
    """The base of all errors here. `str()` is a sentence for people."""


class NotFound(Error, KeyError):
    """The robot has nothing of this name."""

    __str__ = Exception.__str__


class NotReached(Error):
    """There is no connection: nothing was sent."""


class Unconfirmed(Error):
    """The request was sent, and no answer arrived in time. A command may have been carried out. It is not sent again."""


class Refused(Error):
    """The robot has answered with an error. `status`: of HTTP; `report`: the problem details (RFC 9457), with `errors` for an input that is wrong."""

    def __init__(self, url, status, reason, report):
        self.url, self.status, self.report = url, status, report
        errors = [e for e in report.get("errors", []) if isinstance(e, dict) and e.get("detail")]
        found = [(e.get("pointer", "").lstrip("#") + ": ").lstrip(": ") + e["detail"] for e in errors]
        super().__init__("%s: %d %s: %s" % (url, status, reason, "; ".join(found) or report.get("detail") or "without a reason"))


class Late(Refused):
    """The command arrived after its time and was not carried out."""


class Stopped(Refused):
    """The robot is stopped: release it first."""


class Controlled(Refused):
    """Somebody else has the control."""


class Failed(Error):
    """An invocation has ended, and not with success. `status`: its last representation."""

    def __init__(self, url, status):
        self.url, self.status = url, status
        super().__init__("%s: %s: %s" % (url, status.get("status"), status.get("error") or "without a reason"))


_ERRORS = {TERMS + "LateCommand": Late, TERMS + "Stopped": Stopped, TERMS + "ControlledByAnother": Controlled}

Value = collections.namedtuple("Value", "value time sequence left_out")
Value.__doc__ = """A value that was watched: `time` (ISO 8601) when it became so, its number, how many were left out before it. None: not known."""
Gap = collections.namedtuple("Gap", "reason left_out")
Gap.__doc__ = """Changes are missing, for example because the connection was lost. `left_out`: their number, None if it is not known."""


def open(url=None, **options):
    """The robot at a URL, by default that of the environment variable LRT_ROBOT. Options: those of Robot."""
    return Robot(url or os.environ.get("LRT_ROBOT") or "http://127.0.0.1:8080/", **options)


class Robot:
    """A server of lrt. Reads what it is: NotReached if it cannot be reached.

    token      for `Authorization: Bearer`; default: LRT_TOKEN
    ca         file with the certificates (PEM) that are trusted for https; default: those of the system
    timeout    [s] for the answer to what changes nothing
    valid_for  [s] how long a command is worth carrying out; None: as long as it takes
    """

    def __init__(self, url, token=None, ca=None, timeout=10.0, valid_for=2.0):
        self.url = urllib.parse.urljoin(url, urllib.parse.urlsplit(url).path or "/")
        self.timeout, self.valid_for = timeout, valid_for
        self._http = _Http(self.url, token or os.environ.get("LRT_TOKEN"), ca)
        self._lock = threading.Lock()
        self._root = self._get(self.url)
        self._things = None

    def __repr__(self):
        return "<lrt.Robot %s>" % self.url

    def things(self):
        """All Things, those in others included. They are read once; `refresh()` reads them anew."""
        with self._lock:
            if self._things is None:
                self._things = [Thing(self, each) for each in (self._structure() if "structure" in self._root else self._crawl())]
            return list(self._things)

    def _structure(self):
        """What each Thing is, from the document that has this of all of them."""
        url = self._root["structure"]["href"]
        base, found = url[: -len("/ns/structure")], []
        while url:
            page = self._get(url)
            found += [_of_kind(base + each["path"], each, page["kinds"].get(each["kind"], {})) for each in page["things"]]
            url = page.get("next", {}).get("href")
        return found

    def _crawl(self):
        """The same of a server that has no such document, by a request for each Thing."""
        found, waiting, seen = [], [self._root], set()
        while waiting:
            for each in waiting.pop(0).get("things", []):
                if each["href"] not in seen:
                    seen.add(each["href"])
                    found.append(self._get(each["href"]))
                    waiting.append(found[-1])
        return found

    def refresh(self):
        """Forgets what the robot was: the next call reads it again."""
        root = self._get(self.url)
        with self._lock:
            self._root, self._things = root, None

    def names(self):
        """The paths of all Things, "baxter/right_s1"."""
        return [thing.name for thing in self.things()]

    def __getitem__(self, name):
        """The Thing of this name, title or path. NotFound if there is none, or if several have it."""
        return _find(self.things(), name, "the robot", "Thing", lambda t: [t.name, t.title, t.url])

    def stop(self):
        """Invokes every stop that was known when the robot was opened. Returns a Run for each. It does not expire: if the link is frozen, the
        robot stops when it thaws. Each stop is tried; then the first error is raised."""
        runs, errors = [], []
        for each in self._root.get("stops", []):
            try:
                _, answer, _ = self._command("POST", each["href"], None, expires=False)
                runs.append(Run(self, urllib.parse.urljoin(each["href"], answer.get("Location", "")), None))
            except Error as error:
                errors.append(error)
        if errors:
            raise errors[0]
        if not runs:
            raise NotFound("%s has no stop" % self.url)
        return runs

    def stopped(self):
        """Whether, since when, by whom: a list with a dict for each Thing that says so, empty if none does."""
        return self._get(self.url).get("stopStates", [])

    def _get(self, url):
        status, reason, fields, body = self._http.request("GET", url, {"Accept": "application/json"}, None, self.timeout)
        if status != 200:
            raise _refused(url, status, reason, body)
        if fields.get("Content-Type", "").split(";")[0].strip() != "application/json":
            raise Error("%s is %s: this file needs a server that has application/json, as those of lrt" % (url, fields.get("Content-Type")))
        return _json(url, body)

    def _command(self, method, url, value, expires=True, fields=()):
        """Sends a command, once. Returns (status, fields, body)."""
        fields = dict(fields, Accept="application/json")
        if value is not None:
            fields.setdefault("Content-Type", "application/json")
        body = None if value is None else json.dumps(value, allow_nan=False).encode()
        life = self.valid_for if expires else None
        limit = self.timeout if life is None else life
        if life is not None:
            until = self._http.clock.after(life)
            if until is not None:  # else the robot does not say its time
                fields["Valid-Until"] = until
        status, reason, answer, body = self._http.request(method, url, fields, body, limit)
        if status >= 300:
            raise _refused(url, status, reason, body)
        return status, answer, body


class Thing:
    """A Thing of a robot. `name` is its path, `title` is for people, `properties` and `actions` have what is known of each, by name."""

    def __init__(self, robot, description):
        self._robot, self._description = robot, description
        self.url = description["href"]
        self.name = _path(self.url)
        self.title = description.get("title", self.name)
        self.properties = {_plain(k): v for k, v in description.get("properties", {}).items()}
        self.actions = {_plain(k): v for k, v in description.get("actions", {}).items()}

    def __repr__(self):
        return "<lrt.Thing %s>" % self.name

    def read(self, name=None, unit=None):
        """The value of a Property, in this unit if one is given; without a name the values of all, as a dict. Of Properties that the robot cannot
        read now, its member "@errors" is a dict with the reasons."""
        if name is None:
            return self._robot._get(self._description["state"]["href"])
        known = self._property(name)
        return _converted(self._robot._get(known["href"]), known, unit)

    def write(self, name, value, unit=None, if_match=None):
        """Gives a Property a value. `unit`: that of `value`, if it is not the robot's. `if_match`: the entity tag that it must still have."""
        known = self._property(name)
        if "PUT" not in known["methods"]:
            raise Error("%s/%s cannot be written" % (self.name, name))
        self._robot._command("PUT", known["href"], _sent(value, known.get("schema", {}), unit), fields={"If-Match": if_match} if if_match else {})

    def patch(self, name, changes=None, if_match=None, **parts):
        """Gives some fields of a record new values: `patch("command", position=0.1)`. The robot keeps the others as it has them then. None clears a field that
        may be absent, and restores a default. A dict changes parts of a field. `changes`: a dict with the same, for names that are no words of Python."""
        known = self._property(name)
        if "PUT" not in known["methods"]:
            raise Error("%s/%s cannot be written" % (self.name, name))
        fields = {"Content-Type": "application/merge-patch+json", **({"If-Match": if_match} if if_match else {})}
        self._robot._command("PATCH", known["href"], dict(changes or {}, **parts), fields=fields)

    def tag(self, name):
        """The entity tag of a Property, for `if_match`."""
        url = self._property(name)["href"]
        status, reason, fields, body = self._robot._http.request("HEAD", url, {"Accept": "application/json"}, None, self._robot.timeout)
        if status != 200:
            raise _refused(url, status, reason, body)
        return fields.get("ETag")

    def invoke(self, name, value=None, unit=None, start_before=None):
        """Invokes an Action. Returns a Run. `start_before`: [s] from now; the invocation fails if it has not begun then."""
        known = _find_key(self.actions, name, self.name, "Action")
        fields = {}
        if start_before is not None:
            begin = self._robot._http.clock.after(start_before)
            if begin is None:
                raise Error("%s does not say its time: start_before cannot be used" % self.url)
            fields["Start-Before"] = begin
        body = _sent(value, known.get("input", {}), unit)
        _, answer, body = self._robot._command("POST", known["href"], body, not known.get("stop"), fields)
        return Run(self._robot, urllib.parse.urljoin(known["href"], answer.get("Location", "")), _json(known["href"], body) if body else None)

    def watch(self, name=None, unit=None, queue=0, interval=0.0, reconnect=True):
        """Yields a Value for each change of a Property, or of all together without a name, beginning with the present one; a Gap where changes
        are missing.

        queue     how many changes wait for this program; 0: only the newest
        interval  [s] between two values, at least
        """
        if name is None:
            url, known = self._description["state"]["href"], {}
        else:
            known = self._property(name)
            url = known["href"]
        _factor(known, unit)
        for change in _Watch(self._robot, url, queue, interval, reconnect):
            yield change._replace(value=_converted(change.value, known, unit)) if isinstance(change, Value) else change

    async def watch_async(self, name=None, unit=None, queue=0, interval=0.0, reconnect=True):
        """`watch` for asyncio: `async for change in thing.watch_async("position")`. A thread reads; 256 changes wait, then the connection does."""
        async for change in _in_thread(lambda: self.watch(name, unit, queue, interval, reconnect)):
            yield change

    def create(self, collection, value):
        """Adds a member to a collection. Returns its URL."""
        known = _find_key({_plain(k): v for k, v in self._description.get("collections", {}).items()}, collection, self.name, "collection")
        _, answer, _ = self._robot._command("POST", known["href"], value)
        return urllib.parse.urljoin(known["href"], answer["Location"])

    def _property(self, name):
        return _find_key(self.properties, name, self.name, "Property")


class Run:
    """An invocation of an Action. `output` is what it gave, None as long as there is nothing."""

    ENDED = ("succeeded", "failed", "cancelled")

    def __init__(self, robot, url, output):
        self._robot, self.url, self.output = robot, url, output

    def __repr__(self):
        return "<lrt.Run %s>" % self.url

    def status(self):
        """What the robot says of it: a dict with `status`, and `progress` (0 to 1) if the robot tells it."""
        return self._robot._get(self.url)

    def changes(self):
        """Yields its status at each change, until it has ended."""
        for change in _Watch(self._robot, self.url, 64, 0.0, True):
            if isinstance(change, Value):
                yield change.value
                if change.value.get("status") in self.ENDED:
                    return

    def wait(self, seconds=None):
        """Waits until it has ended. Returns its output. Failed if it did not succeed, TimeoutError if it takes longer."""
        until = None if seconds is None else time.monotonic() + seconds
        pause = 0.01
        while True:
            status = self.status()
            if status.get("status") in self.ENDED:
                break
            if until is not None and time.monotonic() > until:
                raise TimeoutError("%s has not ended after %g s: %s" % (self.url, seconds, status.get("status")))
            time.sleep(pause)
            pause = min(0.25, pause * 1.5)
        if status["status"] != "succeeded":
            raise Failed(self.url, status)
        self.output = status.get("output", self.output)
        return self.output

    def cancel(self):
        """Asks the robot to end it. What has ended already stays as it is."""
        try:
            self._robot._command("DELETE", self.url, None, expires=False)
        except Refused as refused:
            if refused.status not in (404, 409, 410):
                raise

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        if kind is not None:  # left by an error: the robot does not go on alone
            self.cancel()


# What follows is not for users.


class _Clock:
    """The newest word of the robot about its time. A command may only use what was received, plus the time that has passed here since."""

    def __init__(self):
        self._lock, self._instance, self._ms, self._at = threading.Lock(), None, 0, 0.0

    def heard(self, text):
        match = re.fullmatch(r"([0-9A-Za-z]{1,64})/([0-9]{1,15})", text or "")
        if not match:
            return
        now, ms = time.monotonic(), int(match[2])
        with self._lock:
            if match[1] != self._instance or ms >= self._ms + (now - self._at) * 1000:
                self._instance, self._ms, self._at = match[1], ms, now
            elif self._at + 60 < now:  # the clocks of two machines drift apart: after a minute any newer word is taken
                self._ms, self._at = ms, now

    def after(self, seconds):
        with self._lock:
            if self._instance is None:
                return None
            return "%s/%d" % (self._instance, max(0, self._ms + int((time.monotonic() - self._at + seconds) * 1000)))


class _Http:
    """Connections to one robot. A connection is kept for the next request. A request is never sent twice, unless it changes nothing."""

    def __init__(self, url, token, ca):
        parts = urllib.parse.urlsplit(url)
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise Error("expected the URL of a robot, http://host:port/, found %s" % url)
        self._origin = (parts.scheme, parts.hostname, parts.port or (443 if parts.scheme == "https" else 80))
        self._token = token
        self._tls = ssl.create_default_context(cafile=ca) if parts.scheme == "https" else None
        self._idle, self._lock = [], threading.Lock()
        self.clock = _Clock()

    def connect(self, timeout):
        scheme, host, port = self._origin
        if scheme == "https":
            connection = http.client.HTTPSConnection(host, port, timeout=timeout, context=self._tls)
        else:
            connection = http.client.HTTPConnection(host, port, timeout=timeout)
        try:
            connection.connect()
            connection.sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            connection.sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)  # a peer that has gone is noticed, minutes later
        except (OSError, ssl.SSLError) as error:
            connection.close()
            raise NotReached("%s://%s:%d/: %s" % (scheme, host, port, error)) from error
        return connection

    def target(self, url):
        """The path of a URL of this robot. Nothing is sent to another host: the token is this robot's."""
        parts = urllib.parse.urlsplit(url)
        origin = (parts.scheme, parts.hostname, parts.port or (443 if parts.scheme == "https" else 80))
        if origin != self._origin:
            raise Error("%s is not at %s://%s:%d/, where this robot was opened: open it by that address" % ((url,) + self._origin))
        return urllib.parse.urlunsplit(("", "", parts.path or "/", parts.query, ""))

    def fields(self, fields):
        return dict(fields, Authorization="Bearer " + self._token) if self._token else fields

    def request(self, method, url, fields, body, limit):
        """(status, reason, fields, body) of the answer."""
        target, until = self.target(url), time.monotonic() + limit
        while True:
            with self._lock:
                connection = self._idle.pop() if self._idle and method in ("GET", "HEAD") else None
            kept = connection is not None
            connection = connection or self.connect(max(0.001, until - time.monotonic()))
            try:
                connection.sock.settimeout(max(0.001, until - time.monotonic()))
                connection.request(method, target, body, self.fields(fields))
                response = connection.getresponse()
                self.clock.heard(response.headers.get("Robot-Time"))
                content = response.read(MAX_BODY + 1)
            except (OSError, http.client.HTTPException) as error:
                connection.close()
                if kept and not isinstance(error, TimeoutError):  # the robot has closed a connection that was kept
                    continue
                raise Unconfirmed("%s %s: no answer within %g s (%s)" % (method, url, limit, error or type(error).__name__)) from error
            if len(content) > MAX_BODY:
                connection.close()
                raise Error("%s is longer than %d bytes" % (url, MAX_BODY))
            if response.will_close:
                connection.close()
            else:
                with self._lock:
                    self._idle.append(connection)
                    surplus = self._idle[:-4]
                    del self._idle[:-4]
                for each in surplus:
                    each.close()
            return response.status, response.reason, response.headers, content


class _Watch:
    """The changes of a resource, by an event stream that is opened again when it is lost."""

    SILENCE = 3.0  # [s] without a word, when the robot has promised one each second

    def __init__(self, robot, url, queue, interval, reconnect):
        self._robot, self._reconnect = robot, reconnect
        query = {"accept": "application/json", "heartbeat": "1"}
        if queue:
            query["queueLength"] = str(queue)
        if interval:
            query["minimumInterval"] = "%g" % interval
        self._url, self._queue = url + ("&" if "?" in url else "?") + urllib.parse.urlencode(query), queue
        self._series = self._number = self._lost = None

    def __iter__(self):
        wait = 0.1
        while True:
            try:
                for change in self._connection():
                    wait = 0.1
                    yield change
                self._lost = "the robot has ended the stream"
            except (Unconfirmed, NotReached) as error:
                self._lost = str(error)
            except Refused as error:
                if error.status != 503:
                    raise
                self._lost = str(error)
            if not self._reconnect:
                raise NotReached("%s: %s" % (self._url, self._lost))
            time.sleep(wait * (0.5 + random.random() / 2))
            wait = min(5.0, wait * 2)

    def _connection(self):
        http_ = self._robot._http
        connection = http_.connect(self._robot.timeout)
        socket_ = connection.sock  # the response takes it from the connection
        try:
            connection.request("GET", http_.target(self._url), None, http_.fields({"Accept": "text/event-stream"}))
            response = connection.getresponse()
            http_.clock.heard(response.headers.get("Robot-Time"))
            if response.status != 200:
                raise _refused(self._url, response.status, response.reason, response.read(MAX_BODY))
            socket_.settimeout(None)  # a robot that does not know heartbeats is silent as long as nothing changes
            yield from self._events(socket_, response)
        except (OSError, http.client.HTTPException) as error:
            raise Unconfirmed("%s: %s" % (self._url, error or type(error).__name__)) from error
        finally:
            connection.close()

    def _events(self, socket_, response):
        series, event, size = response.headers.get("Value-Series"), {}, 0
        while True:
            line = response.readline(MAX_BODY + 1)
            if not line:
                return
            size += len(line)
            if size > MAX_BODY:
                raise Error("%s: an event is longer than %d bytes" % (self._url, MAX_BODY))
            line = line.rstrip(b"\r\n").decode("utf-8", "replace")
            if line:
                name, _, text = line.partition(":")
                text = text[1:] if text.startswith(" ") else text
                event[name] = event[name] + "\n" + text if name == "data" and "data" in event else text
                continue
            size = 0
            if event.get("event") == "heartbeat":
                self._robot._http.clock.heard(event.get("data"))
                socket_.settimeout(self.SILENCE)
            elif "data" in event and event.get("event", "message") == "message":
                yield from self._change(series, event)
            event = {}

    def _change(self, series, event):
        number = int(event["sequence"]) if event.get("sequence", "").isdigit() else None
        left_out = int(event["left-out"]) if event.get("left-out", "").isdigit() else 0 if number is not None else None
        if self._lost:
            missing = number - self._number - 1 if series == self._series and None not in (number, self._number) else None
            if missing != 0:
                yield Gap(self._lost, missing)
            left_out, self._lost = 0, None
        elif self._queue and left_out:
            yield Gap("this program reads too slowly", left_out)
        self._series, self._number = series, number
        yield Value(_json(self._url, event["data"].encode()), event.get("time"), number, left_out)


async def _in_thread(generator):
    """The items of a blocking generator, as an asynchronous one."""
    loop, queue, free, ended = asyncio.get_running_loop(), asyncio.Queue(), threading.Semaphore(256), threading.Event()
    end = object()

    def run():
        error = end
        try:
            for item in generator():
                while not free.acquire(timeout=0.1):
                    if ended.is_set():
                        return
                if ended.is_set():
                    return
                loop.call_soon_threadsafe(queue.put_nowait, (item, None))
        except Exception as found:  # it is raised where the items are awaited
            error = found
        try:
            loop.call_soon_threadsafe(queue.put_nowait, (end, error))
        except RuntimeError:
            pass  # the loop is closed: nobody waits

    threading.Thread(target=run, daemon=True).start()
    try:
        while True:
            item, error = await queue.get()
            if item is end:
                if error is not end:
                    raise error
                return
            free.release()
            yield item
    finally:
        ended.set()


def _of_kind(url, thing, kind):
    """What a Thing is, as its own document has it."""

    def placed(table, method):
        return {
            name: dict(each, href="%s/%s" % (url, each.get("path", name)), methods=["GET"] + [method] * (method != "PUT" or "writable" in each))
            for name, each in kind.get(table, {}).items()
        }

    words = {key: thing[key] for key in ("title", "description") if key in thing}
    tables = {"properties": placed("properties", "PUT"), "actions": placed("actions", "POST"), "collections": placed("collections", "POST")}
    return {"href": url, "title": _path(url).split("/")[-1], "state": {"href": url + "/" + kind.get("state", "state")}, **words, **tables}


def _json(url, body):
    try:
        return json.loads(body)
    except ValueError as error:
        raise Error("%s is not JSON: %s" % (url, error)) from error


def _refused(url, status, reason, body):
    try:
        report = json.loads(body)
    except ValueError:
        report = {}
    report = report if isinstance(report, dict) else {}
    return _ERRORS.get(report.get("type"), Refused)(url, status, reason, report)


def _plain(name):
    return urllib.parse.unquote(name)


def _path(url):
    return _plain(urllib.parse.urlsplit(url).path).strip("/")


def _find_key(table, name, owner, kind):
    return table[_find(list(table), name, owner, kind, lambda key: [key, table[key].get("title"), table[key].get("href")])]


def _find(items, name, owner, kind, names):
    """The one item that has this name: whole, or as the last parts of a path."""
    name = name.strip("/") if not name.startswith("http") else name
    whole = [item for item in items if name in names(item)]
    found = whole or [item for item in items if any(n and ("/" + n).endswith("/" + name) for n in names(item))]
    if len(found) == 1:
        return found[0]
    known = [names(item)[0] for item in items]
    if found:
        raise NotFound("%s has several of the name %s: %s" % (owner, name, ", ".join(names(item)[0] for item in found)))
    near = difflib.get_close_matches(name, known, 3) or difflib.get_close_matches(name, [n.split("/")[-1] for n in known], 3)
    hint = "is it %s?" % " or ".join(near) if near else "it has " + (", ".join(known[:20]) or "none")
    raise NotFound("%s has no %s %s; %s" % (owner, kind, name, hint))


# The units that robots use: (kind, factor to the first of its kind, offset). By UCUM code, and by what people write instead.
_PI = 3.141592653589793
_UNITS = {
    "rad": ("angle", 1),
    "deg": ("angle", _PI / 180),
    "circ": ("angle", 2 * _PI),
    "rad/s": ("speed of rotation", 1),
    "deg/s": ("speed of rotation", _PI / 180),
    "circ/min": ("speed of rotation", _PI / 30),
    "m": ("length", 1),
    "mm": ("length", 1e-3),
    "cm": ("length", 1e-2),
    "km": ("length", 1e3),
    "um": ("length", 1e-6),
    "[in_i]": ("length", 0.0254),
    "[ft_i]": ("length", 0.3048),
    "m/s": ("speed", 1),
    "mm/s": ("speed", 1e-3),
    "km/h": ("speed", 1 / 3.6),
    "s": ("time", 1),
    "ms": ("time", 1e-3),
    "us": ("time", 1e-6),
    "min": ("time", 60),
    "h": ("time", 3600),
    "N": ("force", 1),
    "kN": ("force", 1e3),
    "N.m": ("torque", 1),
    "kN.m": ("torque", 1e3),
    "kg": ("mass", 1),
    "g": ("mass", 1e-3),
    "K": ("temperature", 1),
    "Cel": ("temperature", 1, 273.15),
    "[degF]": ("temperature", 5 / 9, 459.67 * 5 / 9),
    "V": ("voltage", 1),
    "mV": ("voltage", 1e-3),
    "A": ("current", 1),
    "mA": ("current", 1e-3),
    "Hz": ("frequency", 1),
    "kHz": ("frequency", 1e3),
    "1": ("ratio", 1),
    "%": ("ratio", 1e-2),
}
_SPELLINGS = {
    "°": "deg",
    "°/s": "deg/s",
    "turn": "circ",
    "rev": "circ",
    "rpm": "circ/min",
    "in": "[in_i]",
    "ft": "[ft_i]",
    "µm": "um",
    "µs": "us",
    "kph": "km/h",
    "Nm": "N.m",
    "kNm": "kN.m",
    "°C": "Cel",
    "°F": "[degF]",
}


def _factor(known, unit):
    """(factor, offset) by which a number in `unit` becomes one in the robot's unit."""
    schema = known.get("schema", known)
    if unit is None:
        return 1, 0
    own = schema.get("unit")
    unit = _SPELLINGS.get(unit, unit)
    if own is None or schema.get("type") not in ("number", "integer"):
        raise Error("%s is no number with a unit, it cannot be in %s" % (known.get("href", "the input"), unit))
    if unit == own:
        return 1, 0
    if unit not in _UNITS or own not in _UNITS or _UNITS[unit][0] != _UNITS[own][0]:
        kind = _UNITS.get(own, (None,))[0]
        others = "; it can be in " + ", ".join(u for u, k in _UNITS.items() if k[0] == kind) if kind else ""
        raise Error("%s is in %s, it cannot be in %s%s" % (known.get("href", "the input"), own, unit, others))
    (_, factor, *offset), (_, divisor, *minus) = _UNITS[unit], _UNITS[own]
    return factor / divisor, ((offset or [0])[0] - (minus or [0])[0]) / divisor


def _converted(value, known, unit):
    factor, offset = _factor(known, unit)
    return value if unit is None or value is None else (value - offset) / factor


def _sent(value, schema, unit):
    if unit is None:
        return value
    factor, offset = _factor(schema, unit)
    return value * factor + offset
