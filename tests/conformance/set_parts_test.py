# SPDX-License-Identifier: Apache-2.0
"""The command lrt and lrt.py change parts of a record.

    set_parts_test.py LRT RANDOM_BODIES_ROBOT SOURCE_DIR
"""

import json
import os
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True  # nothing is left in the source tree
from robot_process import Program, http_request

LRT, ROBOT, SOURCE = sys.argv[1:4]
START = {"gain": 1, "limit": 1, "count": 1, "name": "a", "gear": "first", "active": True, "offset": 1, "steps": [1], "limits": {"low": -1, "high": 1}, "extra": {}}


def main():
    program = Program(ROBOT)
    url = program.url + "machine/tuning"
    try:
        with tempfile.TemporaryDirectory() as cache:
            env = {**{k: v for k, v in os.environ.items() if not k.startswith("LRT_")}, "LRT_ROBOT": program.url, "XDG_CACHE_HOME": cache, "LC_ALL": "C.UTF-8"}

            def lrt(*words):
                done = subprocess.run([LRT, "set", "machine/tuning", *words], capture_output=True, text=True, timeout=60, env=env, check=False)
                return done.returncode, done.stderr

            def value():
                return json.loads(http_request("GET", url, None, {"Accept": "application/json"}).expect(200).body)

            def changes(words, **parts):
                before = value()
                status, said = lrt(*words)
                assert (status, said) == (0, ""), (words, status, said)
                after = value()
                assert after == {**before, **parts}, (words, after)

            def refuses(words, text):
                before = value()
                status, said = lrt(*words)
                assert status in (1, 2) and text in said, (words, status, said)
                assert value() == before, words

            http_request("PUT", url, json.dumps(START), {"Content-Type": "application/json"}).expect(204)
            changes(["gain=30cm"], gain=0.3)
            changes(["limit=2", "limits.high=7"], limit=2, limits={"low": -1, "high": 7})
            changes(["name=a=b", "gear=reverse", "active=false", "steps=[7,8]", "extra.z=5", "count=007"], name="a=b", gear="reverse", active=False, steps=[7, 8],
                    extra={"z": 5}, count=7)
            changes(["gain=null", "limits.low=null"], gain=1.5, limits={"low": -1, "high": 7})
            assert lrt("offset=null") == (0, "") and "offset" not in value()
            refuses(["limit=null"], "/limit")
            refuses(["gain=11"], "/gain")
            refuses(["gain=3deg"], "cannot convert")
            refuses(["active=yes"], "/active")
            refuses(["nosuch=1"], 'only "gain", "limit"')
            refuses(["gain=1", "gain=2"], "twice")
            refuses(["gain=1", "2"], "set takes")
            refuses(["gain=2", "--if-match", "old"], "412")
            refuses(['{"gain": 2}'], 'lacks "limit"')
            refuses(['{"gain": 2}'], "lrt set machine/tuning gain=")

            sys.path.insert(0, os.path.join(SOURCE, "tools", "python"))
            import lrt as library
            machine = library.open(program.url)["machine"]
            machine.patch("tuning", {"limit": 5}, limits={"high": 9})
            assert value()["limit"] == 5 and value()["limits"] == {"low": -1, "high": 9}
            for name, parts in (("tuning", {"limit": None}), ("count", {"x": 1}), ("nosuch", {"x": 1})):
                try:
                    machine.patch(name, **parts)
                    raise AssertionError(name)
                except library.Error:
                    pass
    finally:
        program.kill()
    return 0


if __name__ == "__main__":
    sys.exit(main())
