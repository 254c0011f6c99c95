# SPDX-License-Identifier: Apache-2.0
"""Drives the arm of examples/baxter: drive_baxter.py URL"""

import sys

import lrt

robot = lrt.open(sys.argv[1])
print("joints:", *[name for name in robot.names() if "rotate" in robot[name].actions])

shoulder, elbow = robot["right_s1"], robot["right_e0"]
shoulder.write("friction", 0.5)

for angle in (10, 20, 0):
    elbow.invoke("rotate", -angle / 2, "deg")  # both move at the same time
    run = shoulder.invoke("rotate", angle, "deg")
    for status in run.changes():
        print("%3.0f %%" % (100 * status.get("progress", 0)), end="\r")
    print("at %.1f deg" % shoulder.read("position", "deg"))

shoulder.invoke("rotate", 30, "deg")
for change in shoulder.watch("position", "deg"):
    if isinstance(change, lrt.Value) and change.value > 5:
        print("beyond 5 deg at", change.time)
        break

try:
    shoulder.invoke("rotate", 500, "deg")
except lrt.Refused as error:
    print(error)
