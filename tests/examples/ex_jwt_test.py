# SPDX-License-Identifier: Apache-2.0
"""examples/ex_jwt with good and bad tokens. They are made here, with openssl, so that a library's own idea of a token does not count.

   ex_jwt_test.py EX_JWT
"""

import base64
import hashlib
import hmac
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "conformance"))

from robot_process import Program, http_request  # noqa: E402

ABSENT = object()
ISSUER, AUDIENCE = "https://login.example", "https://robot.example"


def encoded(data):
    return base64.urlsafe_b64encode(data).rstrip(b"=").decode()


class Key:
    def __init__(self, folder, name):
        self.private, public = os.path.join(folder, name), os.path.join(folder, name + ".pub")
        subprocess.run(["openssl", "genrsa", "-out", self.private, "2048"], check=True, stderr=subprocess.DEVNULL)
        subprocess.run(["openssl", "rsa", "-in", self.private, "-pubout", "-out", public], check=True, stderr=subprocess.DEVNULL)
        self.public = public

    def sign(self, data):
        return subprocess.run(["openssl", "dgst", "-sha256", "-sign", self.private], input=data, check=True, stdout=subprocess.PIPE).stdout


def token(sign, algorithm="RS256", header=None, **changes):
    claims = {"iss": ISSUER, "aud": AUDIENCE, "sub": "anna", "scope": "read move", "exp": int(time.time()) + 3600, **changes}
    header = {"alg": algorithm, "typ": "JWT", **(header or {})}
    signed = ".".join(encoded(json.dumps(part).encode()) for part in (header, {k: v for k, v in claims.items() if v is not ABSENT}))
    return signed + "." + encoded(sign(signed.encode()))


def main():
    if not shutil.which("openssl"):
        print("skipped: there is no openssl")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        key, other = Key(folder, "key"), Key(folder, "other")
        with open(key.public, "rb") as file:
            public = file.read()
        with Program(sys.argv[1], key.public, ISSUER, AUDIENCE, "0") as robot:
            def status(text, method="GET", body=None):
                return http_request(method, robot.url + "arm/angle", body, {"Authorization": "Bearer " + text, "Content-Type": "application/json"}).status

            good = token(key.sign)
            assert status(good) == 200 and status(good, "PUT", "5") == 204
            assert status(token(key.sign, scope="read"), "PUT", "5") == 403 and status(token(key.sign, scope="read")) == 200
            assert status(token(key.sign, scope="")) == 403
            now = int(time.time())
            bad = {
                "nothing": "", "no token": "a.b.c", "expired": token(key.sign, exp=now - 1), "without an end": token(key.sign, exp=ABSENT),
                "not valid yet": token(key.sign, nbf=now + 3600), "signed by somebody else": token(other.sign),
                "for another robot": token(key.sign, aud="https://other.example"), "of another issuer": token(key.sign, iss="https://other.example"),
                "of nobody": token(key.sign, sub=ABSENT), "alg none": token(lambda data: b"", "none"), "alg None": token(lambda data: b"", "None"),
                "alg none with a signature": token(key.sign, "none"), "HS256 with the public key as secret": token(lambda data: hmac.new(public, data, hashlib.sha256).digest(), "HS256"),
                "changed": good[:40] + ("A" if good[40] != "A" else "B") + good[41:], "cut": good[:-8], "without a signature": good.rsplit(".", 1)[0] + ".",
            }
            # Claims of each type of JSON, those of a time also as numbers at their ends.
            no_text = [None, True, False, 0, 1.5, -1, 1e300, {}, {"a": "b"}, []]
            no_time = [None, True, False, "", "0", "1", str(now - 9), "soon", {}, {"a": 1}, [], [now - 9], -1, -0.5, -1e300, -2**63]
            too_late = [now + 3600, now + 3600.5, 2**31, 2**63 - 1, 1e18, 1e300, 253402300800]
            for claim in ("exp", "nbf", "iat"):
                bad.update((f"{claim} {value!r}", token(key.sign, **{claim: value})) for value in no_time)
            bad.update((f"nbf {value!r}", token(key.sign, nbf=value)) for value in too_late)
            bad.update((f"exp {value!r}", token(key.sign, exp=value)) for value in (0, 1, now - 1, now - 0.5, 1e300))
            for claim in ("iss", "sub", "aud", "scope"):
                bad.update((f"{claim} {value!r}", token(key.sign, **{claim: value})) for value in no_text)
            for claim in ("iss", "sub", "scope"):
                bad[claim + " in an array"] = token(key.sign, **{claim: [{"iss": ISSUER, "sub": "anna", "scope": "read"}[claim]]})
            for value in ([AUDIENCE, 1], [[AUDIENCE]], ["other"], ["\"" + AUDIENCE], [AUDIENCE + "\\"], {"a": AUDIENCE}, ""):
                bad[f"aud {value!r}"] = token(key.sign, aud=value)
            bad["crit"] = token(key.sign, header={"crit": ["exp"]})
            for good_claims in ({"nbf": 0}, {"nbf": now - 1}, {"nbf": now - 0.5}, {"exp": now + 3600.5}, {"exp": 2**32}, {"exp": 2**34}, {"iat": now}, {"iat": now - 0.5},
                                {"aud": [AUDIENCE]}, {"aud": ["a\"],[", AUDIENCE]}, {"aud": [AUDIENCE, "b"]}, {"jti": {"any": 1}}):
                assert status(token(key.sign, **good_claims)) == 200, good_claims
            for what, text in bad.items():
                assert status(text) == 401, (what, status(text))
            # A session stands for it, too, and its password is not in the address.
            login = http_request("POST", robot.url + "ns/session", b"", {"Authorization": "Bearer " + good, "Origin": robot.url[:-1]})
            assert login.status == 204, login
            who = http_request("GET", robot.url + "ns/session", None, {"Cookie": login.headers["Set-Cookie"].split(";")[0]})
            assert json.loads(who.body) == {"name": "anna", "roles": ["read", "move"], "session": True}, who
    print("ok")
    return 0


if __name__ == "__main__":
    sys.exit(main())
