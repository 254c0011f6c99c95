#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Definitions and CDR against strangers: npm's @foxglove/rosmsg, rosmsg2-serialization and the types of rosmsg-msgs-common (Humble, Iron, Jazzy), and the types of
Debian's ros2-test-interface-files, with random values, byte for byte, both ways (oracle.cjs).

oracle_test.py PEER FOLDER: PEER is codec_peer; FOLDER is for the packages, which npm fetches there once. Without node, npm or its registry it exits with 77; in
CI (LRT_CI) that is a failure.
"""
import os
import pathlib
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
PACKAGES = ("@foxglove/rosmsg@5.0.5", "@foxglove/rosmsg2-serialization@3.1.0", "@foxglove/rosmsg-msgs-common@3.2.3")
DEBIAN = pathlib.Path("/usr/share/test_interface_files")


def lacks(why):
    print("skipped:", why)
    sys.exit(1 if os.environ.get("LRT_CI") else 77)


def node_modules(folder):
    if not shutil.which("node") or not shutil.which("npm"):
        lacks("there is no node, or no npm")
    folder.mkdir(parents=True, exist_ok=True)
    if all((folder / "node_modules" / name.rsplit("@", 1)[0] / "package.json").exists() for name in PACKAGES):
        return
    made = subprocess.run(["npm", "install", "--prefix", str(folder), "--no-save", "--no-audit", "--no-fund", "--ignore-scripts", *PACKAGES],
                          cwd=folder, capture_output=True, text=True, timeout=200, check=False)
    if made.returncode != 0:
        lacks("npm cannot install " + ", ".join(PACKAGES) + ": " + made.stderr.strip()[-300:])


def main():
    peer, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    if not DEBIAN.is_dir():
        lacks("there is no " + str(DEBIAN) + " (Debian: ros2-test-interface-files)")
    node_modules(folder)
    common = folder / "node_modules/@foxglove/rosmsg-msgs-common/msgdefs"
    folders = [DEBIAN, *(common / name for name in ("ros2humble", "ros2iron", "ros2jazzy"))]
    done = subprocess.run(["node", str(HERE / "oracle.cjs"), peer, str(folder), *map(str, folders)], timeout=120, check=False)
    sys.exit(done.returncode)


main()
