# SPDX-License-Identifier: Apache-2.0
"""W3C WebDriver with the standard library: as much of it as the tests of the page need."""

import base64
import json
import os
import re
import select
import shutil
import subprocess
import tempfile
import time
import urllib.error
import urllib.request

PATIENCE = 30  # seconds, for whatever must come; nothing is slept for
ELEMENT = "element-6066-11e4-a52e-4f735466cecf"
# Presses the button of each form whose command came too late.
GIVE_AGAIN = """const late = [...document.querySelectorAll('form [role=alert]')].filter((e) => e.innerText.startsWith('Too late'));
    return late.map((e) => e.closest('form').querySelector('.primary:not([disabled])')).filter((b) => b && (b.click(), true)).length;"""


def programs():
    """chromium and chromedriver, or None for what is missing."""
    return shutil.which("chromium"), shutil.which("chromedriver")


class Refused(Exception):
    pass


class Browser:
    gives_again = True  # commands that came too late

    def __init__(self, width=1280, height=900, extra=()):
        chromium, driver = programs()
        self.folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self.log = open(os.path.join(self.folder.name, "log"), "w+")
        port = self._start(driver)
        self.base = f"http://127.0.0.1:{port}/session"
        arguments = ["--headless=new", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run", "--disable-background-networking",
                     "--disable-component-update", "--force-color-profile=srgb", f"--user-data-dir={self.folder.name}/profile", f"--window-size={width},{height}", *extra]
        if os.geteuid() == 0:
            arguments.append("--no-sandbox")  # root has none
        made = self._send("POST", self.base, {"capabilities": {"alwaysMatch": {
            "browserName": "chrome", "goog:chromeOptions": {"binary": chromium, "args": arguments}, "goog:loggingPrefs": {"browser": "ALL"}}}})
        self.base += "/" + made["sessionId"]

    def _start(self, driver):
        """The port of a new chromedriver. It begins anew if the port that it got for IPv6 is taken for IPv4: then it ends at once."""
        end, said = time.monotonic() + PATIENCE, ""
        while time.monotonic() < end:
            self.process, said = subprocess.Popen([driver, "--port=0"], stdout=subprocess.PIPE, stderr=self.log, text=True), ""
            while time.monotonic() < end and (self.process.poll() is None or "IPv4" not in said):
                if port := re.search(r"started successfully on port (\d+)", said):
                    return port.group(1)
                if select.select([self.process.stdout], [], [], 0.2)[0]:
                    said += os.read(self.process.stdout.fileno(), 4096).decode()  # readline() would keep further lines where select() does not see them
            self.process.kill()
            self.process.wait(PATIENCE)
            self.process.stdout.close()
        raise AssertionError(f"chromedriver did not start: {said!r}")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        try:
            self._send("DELETE", self.base)
        except (OSError, Refused):
            pass
        self.process.terminate()
        self.process.wait(PATIENCE)
        self.process.stdout.close()
        self.log.close()
        self.folder.cleanup()

    @staticmethod
    def _send(method, url, body=None):
        data = None if method in ("GET", "DELETE") else json.dumps(body or {}).encode()
        request = urllib.request.Request(url, data, {"Content-Type": "application/json"}, method=method)
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE + 30) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            value = json.load(error)["value"]
            raise Refused(f"{value['error']}: {value['message'].splitlines()[0]}") from None

    def send(self, method, path, body=None):
        return self._send(method, self.base + path, body)

    def devtools(self, command, **parameters):
        return self.send("POST", "/goog/cdp/execute", {"cmd": command, "params": parameters})

    def open(self, url):
        self.send("POST", "/url", {"url": url})

    def url(self):
        return self.send("GET", "/url")

    def run(self, script, *arguments):
        """The value of a function's body in the page."""
        return self.send("POST", "/execute/sync", {"script": script, "args": list(arguments)})

    def until(self, script, what, *arguments, patience=PATIENCE):
        """Asks the page again and again.

        A command that came to the robot after its 2 s, as it does on a busy machine, is given again, as the page asks for; see gives_again."""
        end, found = time.monotonic() + patience, None
        while time.monotonic() < end:
            try:
                found = self.run(script, *arguments)
                if found:
                    return found
                if self.gives_again and end - time.monotonic() < patience - 1 and self.run(GIVE_AGAIN):
                    print("  a command came too late and was given again", flush=True)
            except Refused as error:  # the page changes under the question
                found = error
            time.sleep(0.02)
        raise AssertionError(f"not within {patience} s: {what}; {found!r}; the page says: {self.text()[:1500]}")

    def text(self, selector="body"):
        return self.run("return document.querySelector(arguments[0])?.innerText ?? ''", selector)

    def find(self, selector):
        return self.until("return document.querySelector(arguments[0])", selector, selector)

    def click(self, selector):
        element = self.find(selector)[ELEMENT]
        self.run("arguments[0].scrollIntoView({block: 'center'})", {ELEMENT: element})
        self.send("POST", f"/element/{element}/click")

    def type(self, selector, text):
        element = self.find(selector)[ELEMENT]
        self.send("POST", f"/element/{element}/clear")
        self.send("POST", f"/element/{element}/value", {"text": text})

    def keys(self, text):
        """Pressed one after the other, wherever the focus is."""
        actions = [{"type": kind, "value": key} for key in text for kind in ("keyDown", "keyUp")]
        self.send("POST", "/actions", {"actions": [{"type": "key", "id": "keyboard", "actions": actions}]})

    def drag(self, selector, right, down):
        """With the mouse, from the middle of an element."""
        origin = self.find(selector)
        move = {"type": "pointerMove", "duration": 50}
        actions = [{**move, "origin": origin, "x": 0, "y": 0}, {"type": "pointerDown", "button": 0}, {**move, "origin": "pointer", "x": right, "y": down}, {"type": "pointerUp", "button": 0}]
        self.send("POST", "/actions", {"actions": [{"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": actions}]})

    def size(self, width, height, phone=False):
        self.devtools("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=phone)

    def prefer(self, **features):
        """prefer(color_scheme="dark")"""
        self.devtools("Emulation.setEmulatedMedia", features=[{"name": "prefers-" + k.replace("_", "-"), "value": v} for k, v in features.items()])

    def screenshot(self, path):
        """Of the whole page, not only of what is in the window."""
        shot = self.devtools("Page.captureScreenshot", captureBeyondViewport=True)
        with open(path, "wb") as file:
            file.write(base64.b64decode(shot["data"]))

    def messages(self):
        """What the console has said since the last call, but of commands that came too late."""
        return [m for m in self.send("POST", "/se/log", {"type": "browser"}) if not (self.gives_again and "412 (Precondition Failed)" in m["message"])]


def run_cases(cases, folder, wanted, **options):
    """Runs each case in a browser of its own, with these options of Browser. `folder`: for a screenshot of each that fails. Returns the exit status."""
    missing = [name for name, path in zip(("chromium", "chromedriver"), programs()) if not path]
    if missing:
        print(f"skipped: there is no {' and no '.join(missing)} (vendor/install.sh browser)")
        return 77
    if folder:
        os.makedirs(folder, exist_ok=True)
    failed = 0
    for case in cases:
        if wanted and case.__name__ not in wanted:
            continue
        began = time.monotonic()
        with Browser(**options) as browser:  # without the cookies of the case before
            try:
                case(browser)
                print(f"ok   {case.__name__} ({time.monotonic() - began:.1f} s)", flush=True)
            except (AssertionError, Refused) as error:
                failed += 1
                print(f"FAIL {case.__name__}: {error}", flush=True)
                if folder:
                    browser.screenshot(os.path.join(folder, f"failed-{case.__name__}.png"))
    print(f"{failed} failed")
    return 1 if failed else 0
