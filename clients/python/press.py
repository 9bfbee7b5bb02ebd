#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A complete client of shcdd: a tool approaches a body, presses, slides, holds and leaves.

The same path and the same rules as clients/c/press.c: one pose a period on an absolute clock, no
waiting for answers, answers matched by tool_seq, latency on our own clock only. With --check it
also asks the `shcd` command how deep the held tool is, and compares the force with
stiffness x penetration: two ways to the same number, one through the daemon and one without it.
"""
import argparse
import csv
import math
import select
import subprocess
import sys
import time

import lcm
from shcdmsg import tool_force_t, tool_pose_t

REMEMBERED = 4096  # poses; an answer to an older one is ignored
FORCE_TOLERANCE_N = 1e-6  # of --check


def numbers(*counts):
    def vector(text):
        values = [float(part) for part in text.split(",")]
        if len(values) not in counts or not all(abs(value) <= 10.0 for value in values):
            wanted = " or ".join(str(count) for count in counts)
            raise argparse.ArgumentTypeError(f"not {wanted} numbers of at most 10: {text}")
        return values

    return vector


def bounded(low, high):
    def number(text):
        value = float(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text} is not within {low} to {high}")
        return value

    return number


def read_options():
    p = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    p.add_argument("--tool", type=int, default=0, help="id of the tool in the scene")
    p.add_argument("--radius", type=bounded(0, 1), default=0.0, metavar="M",
                   help="its radius in the scene, 0 for a point")
    p.add_argument("--from", dest="start", type=numbers(3), default=[-0.015, 0.0, 0.06],
                   metavar="X,Y,Z", help="where to start, outside the body, in the world [m]")
    p.add_argument("--to", dest="end", type=numbers(3), default=[0.015, 0.0, 0.06], metavar="X,Y,Z",
                   help="where to end, likewise")
    p.add_argument("--depth", type=bounded(0, 1), default=0.003, metavar="M",
                   help="how deep to press at both ends of the slide")
    p.add_argument("--speed", type=bounded(1e-4, 1), default=0.02, metavar="M/S",
                   help="mean speed of each leg")
    p.add_argument("--hold", type=bounded(0, 3600), default=1.0, metavar="S",
                   help="how long to hold still before leaving")
    p.add_argument("--rate", type=bounded(10, 10000), default=1000.0, metavar="HZ",
                   help="poses in a second")
    p.add_argument("--csv", metavar="FILE", help="write all answers to this file")
    check = p.add_argument_group("check of the held force")
    check.add_argument("--check", metavar="BODY.shcd", help="model of the body")
    check.add_argument("--stiffness", type=bounded(0, 1e6), metavar="N/M", help="in the scene")
    check.add_argument("--pose", type=numbers(3, 7), default=[0.0, 0.0, 0.0],
                       metavar="X,Y,Z[,QW,QX,QY,QZ]", help="of the body in the scene")
    check.add_argument("--shcd", default="shcd", metavar="COMMAND", help="the shcd command")
    options = p.parse_args()
    if options.check and options.stiffness is None:
        p.error("--check needs --stiffness")
    return options


def now_us():
    return time.monotonic_ns() // 1000


def norm(v):
    return math.sqrt(math.fsum(x * x for x in v))


class Client:
    """Sends poses at a fixed rate and keeps every answer: (force message, position, round trip)."""

    def __init__(self, tool, rate_hz):
        self.tool = tool
        self.period_ns = int(1e9 / rate_hz)
        self.lcm = lcm.LCM()
        # A full queue drops the newest message: make it longer than any pause of this program.
        self.lcm.subscribe("SHCD_FORCE", self._on_force).set_queue_capacity(10000)
        self.seq = 0
        self.sent = {}  # seq -> (utime, position)
        self.answers = []
        self.late = 0
        self.deadline_ns = time.monotonic_ns()

    def _on_force(self, _channel, data):
        try:
            m = tool_force_t.decode(data)
        except Exception:  # anybody can send anything; a message that is no force is not ours
            return
        utime, position = self.sent.get(m.tool_seq, (None, None))
        newest = self.answers[-1][0].tool_seq if self.answers else 0
        if m.tool_id != self.tool or m.tool_utime != utime or m.tool_seq < newest:
            return  # for another tool or client, or overtaken by a newer answer
        # A repeated answer (the daemon had no newer pose for that tick) is no round trip.
        trip_s = 1e-6 * (now_us() - utime) if m.tool_seq > newest else math.nan
        self.answers.append((m, position, trip_s))

    def tick(self, position, velocity):
        """Sends a pose, then takes forces until the next point of the time grid, and any still
        waiting."""
        self.seq += 1
        pose = tool_pose_t()
        pose.utime = now_us()
        pose.seq = self.seq
        pose.tool_id = self.tool
        pose.flags = tool_pose_t.HAS_VEL | tool_pose_t.FORCE_ENABLE
        pose.pos = position
        pose.vel = velocity
        self.sent[self.seq] = (pose.utime, position)
        self.sent.pop(self.seq - REMEMBERED, None)
        self.lcm.publish("SHCD_TOOL", pose.encode())

        missed = (time.monotonic_ns() - self.deadline_ns) // self.period_ns
        self.late += missed  # skip them, do not catch up
        self.deadline_ns += (missed + 1) * self.period_ns
        while True:
            left_s = max(0.0, 1e-9 * (self.deadline_ns - time.monotonic_ns()))
            if not select.select([self.lcm.fileno()], [], [], left_s)[0]:
                return
            self.lcm.handle()

    def move(self, a, b, duration_s):
        """Moves straight from a to b with a smooth start and end (minimum jerk)."""
        duration_s += 1e-3
        start_ns = self.deadline_ns
        s = last_s = 0.0
        while last_s < 1.0:
            part = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
            rate = 30.0 * s * s * (1.0 - s) ** 2 / duration_s
            self.tick([x + part * (y - x) for x, y in zip(a, b)],
                      [rate * (y - x) for x, y in zip(a, b)])
            last_s = s
            s = min(1.0, 1e-9 * (self.deadline_ns - start_ns) / duration_s)

    def ask(self, point, offset):
        """Rests at a point until the daemon has answered; the place `offset` outside the surface
        below it. Answers without a body come from a daemon that takes the pose for stale."""
        asked = self.seq
        give_up_ns = time.monotonic_ns() + 10**10
        while (not self.answers or self.answers[-1][0].tool_seq <= asked
               or self.answers[-1][0].body_id < 0):
            if time.monotonic_ns() > give_up_ns:
                sys.exit("press.py: no answer in 10 s: does shcdd run here, with this tool and a "
                         "body in its scene?")
            self.tick(point, [0.0, 0.0, 0.0])
        m = self.answers[-1][0]
        if m.penetration > 0.0:
            sys.exit("press.py: the path does not begin and end outside the body")
        return [x + offset * n for x, n in zip(m.proxy, m.normal)]


def report(client, held, elapsed_s):
    answers = client.answers
    trips = sorted(1e3 * trip for _, _, trip in answers if not math.isnan(trip))
    p50, p99, p999 = (trips[int(part * (len(trips) - 1))] for part in (0.5, 0.99, 0.999))
    first, last = answers[0][0], answers[-1][0]
    limits = tool_force_t.LIMITED | tool_force_t.SLEW
    contact_s = sum(1e-6 * (b[0].utime - a[0].utime)
                    for a, b in zip(answers, answers[1:]) if b[0].penetration > 0.0)
    print(f"poses       {client.seq} sent at {client.seq / elapsed_s:.1f} Hz ({client.late} late), "
          f"{100.0 * len(trips) / (client.seq - first.tool_seq + 1):.2f} % answered")
    print(f"daemon      {1e6 * (last.tick - first.tick) / (last.utime - first.utime):.1f} ticks/s, "
          f"{sum(m.flags & limits != 0 for m, _, _ in answers)} of them with a limited force")
    print(f"round trip  p50 {p50:.3f}, p99 {p99:.3f}, p99.9 {p999:.3f}, max {trips[-1]:.3f} ms")
    peak_n = max(norm(m.force) for m, _, _ in answers)
    peak_mm = 1e3 * max(m.penetration for m, _, _ in answers)
    print(f"contact     {contact_s:.3f} s, at most {peak_n:.4f} N and {peak_mm:.4f} mm deep")
    print(f"held        {norm(held[-1][0].force):.9f} N at a depth of "
          f"{1e3 * held[-1][0].penetration:.9f} mm")


def write_csv(path, answers):
    with open(path, "w", newline="", encoding="ascii") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow("time_s tick seq x_m y_m z_m fx_n fy_n fz_n penetration_m distance_m rtt_s "
                      "flags".split())
        for m, p, trip_s in answers:
            # signed, from the surface to the middle of the tool
            distance = math.fsum((x - y) * n for x, y, n in zip(p, m.proxy, m.normal))
            rows.writerow([f"{1e-6 * (m.utime - answers[0][0].utime):.6f}", m.tick, m.tool_seq, *p,
                           *m.force, m.penetration, distance, f"{trip_s:.6f}", m.flags])


def rotation(quaternion):
    """The matrix of a quaternion w, x, y, z, which need not be quite of length 1."""
    w, x, y, z = (value / norm(quaternion) for value in quaternion)
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]


def check(options, position, held):
    """Compares the held force with stiffness x penetration, the penetration by `shcd query`."""
    turn = rotation(options.pose[3:] or [1.0, 0.0, 0.0, 0.0])
    offset = [x - o for x, o in zip(position, options.pose)]
    in_body = [math.fsum(turn[k][i] * offset[k] for k in range(3)) for i in range(3)]
    point = ",".join(repr(x) for x in in_body)
    try:
        run = subprocess.run([options.shcd, "query", options.check, "--tier", "exact"],
                             input=point + "\n", capture_output=True, text=True, check=False)
    except OSError as error:
        sys.exit(f"press.py: cannot run {options.shcd}: {error.strerror}")
    if run.returncode != 0:
        sys.exit(f"press.py: {options.shcd} query failed: {run.stderr.strip()}")
    row = next(csv.DictReader(run.stdout.splitlines()))
    penetration_m = max(0.0, options.radius - float(row["distance"]))
    normal = [float(row[key]) for key in ("nx", "ny", "nz")]
    expected = [options.stiffness * penetration_m * math.fsum(x * n for x, n in zip(axis, normal))
                for axis in turn]
    # The first half of the hold is left to damping, which needs a moment to fade, and a tick in
    # which the daemon altered the model's force (after a pause of this program) tells nothing.
    altered = (tool_force_t.LIMITED | tool_force_t.SLEW | tool_force_t.FAULT | tool_force_t.RAMP |
               tool_force_t.INACTIVE | tool_force_t.DISABLED | tool_force_t.DEGRADED)
    settled = [m.force for m, _, _ in held[len(held) // 2:] if m.flags & altered == 0]
    worst_n = max((norm([f - e for f, e in zip(force, expected)]) for force in settled),
                  default=math.inf)
    print(f"check       {options.stiffness * penetration_m:.9f} N from {options.stiffness:g} N/m x "
          f"{1e3 * penetration_m:.9f} mm by shcd query; {len(settled)} answers differ from it by "
          f"at most {worst_n:.2g} N")
    if not (penetration_m > 0.0 and worst_n <= FORCE_TOLERANCE_N):
        sys.exit(f"press.py: the held force does not agree within {FORCE_TOLERANCE_N:g} N")


def main():
    options = read_options()
    try:
        client = Client(options.tool, options.rate)
    except RuntimeError as error:
        sys.exit(f"press.py: no LCM ({error}): is there a multicast route on the loopback device?")
    started = time.monotonic()
    offset = options.radius - options.depth
    end = client.ask(options.end, offset)
    start = client.ask(options.start, offset)
    client.move(options.start, start, math.dist(options.start, start) / options.speed)
    client.move(start, end, math.dist(start, end) / options.speed)
    hold_from = client.seq
    client.move(end, end, options.hold)
    held = [a for a in client.answers if a[0].tool_seq > hold_from]
    client.move(end, options.end, math.dist(end, options.end) / options.speed)
    if not held:
        sys.exit("press.py: no answer while holding still")
    report(client, held, time.monotonic() - started)
    if options.csv:
        try:
            write_csv(options.csv, client.answers)
        except OSError as error:
            sys.exit(f"press.py: cannot write {options.csv}: {error.strerror}")
    if options.check:
        check(options, end, held)


if __name__ == "__main__":
    main()
