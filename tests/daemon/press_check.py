# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of the clients need to know about a body and about a finished run.

path    two ends of a short slide above a body's surface, in the world frame
table   checks a client's table: a force that rises and falls smoothly with penetration
held    checks the force on the tool held still in a table against `shcd query`
report  checks the figures that a client prints
junk    sends what is no force on the channel of forces, until it is killed
"""
import argparse
import csv
import json
import math
import re
import subprocess
import sys
import time

HOVER_M = 0.008
SLIDE_M = 0.012
CALM = 64  # tool_force_t.CONTACT: the only flag of a tick in which nothing was held back


def fail(text):
    sys.exit(f"press_check.py: {text}")


def norm(v):
    return math.sqrt(math.fsum(x * x for x in v))


def correlation(a, b):
    mean_a, mean_b = math.fsum(a) / len(a), math.fsum(b) / len(b)
    covariance = math.fsum((x - mean_a) * (y - mean_b) for x, y in zip(a, b))
    return covariance / math.sqrt(math.fsum((x - mean_a) ** 2 for x in a) *
                                  math.fsum((y - mean_b) ** 2 for y in b))


def query(shcd, body, points):
    run = subprocess.run([shcd, "query", body], capture_output=True, text=True, check=True,
                         input="".join(",".join(map(repr, p)) + "\n" for p in points))
    return [{key: float(row[key]) for key in row if key != "flags"}
            for row in csv.DictReader(run.stdout.splitlines())]


def to_world(pose, point):
    """position + q p conj(q), written with the vector part u of q: p + 2 u x (u x p + w p)."""
    w, u = pose[3], pose[4:]

    def cross(a, b):
        return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]

    inner = [x + w * y for x, y in zip(cross(u, point), point)]
    return [o + p + 2.0 * c for o, p, c in zip(pose[:3], point, cross(u, inner))]


def path(options):
    """The surface below a place outside the body, and below one a short way beside it; over both
    of them a place to hover."""
    run = subprocess.run([options.shcd, "info", options.body, "--json"], capture_output=True,
                         text=True, check=True)
    info = json.loads(run.stdout)
    low, high = info["box_min_m"], info["box_max_m"]
    axis = "xyz".index(options.side[0])
    place = [0.5 * (a + b) for a, b in zip(low, high)]
    place[axis] = high[axis] + 0.02 if options.side[1] == "+" else low[axis] - 0.02
    beside = list(place)
    beside[(axis + 1) % 3] += SLIDE_M
    hover = [[row["c" + k] + HOVER_M * row["n" + k] for k in "xyz"]
             for row in query(options.shcd, options.body, [place, beside])]
    for row in query(options.shcd, options.body, hover):
        if not row["lower"] > 0.5 * HOVER_M:
            fail(f"the body has no room for a path on its side {options.side}")
    print(*(",".join(map(repr, to_world(options.pose, p))) for p in hover))


def read_table(file):
    with open(file, newline="", encoding="ascii") as lines:
        rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(lines)]
    if len(rows) < 500:
        fail(f"{file} has only {len(rows)} rows")
    for row in rows:
        if not all(math.isfinite(row[key]) for key in row if key != "rtt_s"):
            fail(f"{file} holds a number that is not finite")
        row["force_n"] = norm([row["fx_n"], row["fy_n"], row["fz_n"]])
    return rows


def held_rows(rows):
    """Those of a tool that touches and does not move. One that has just begun to move has a speed
    before it has another place, hence 50 rows to both sides."""
    places = [[row[key] for key in ("x_m", "y_m", "z_m")] for row in rows]
    held = [row for i, row in enumerate(rows)
            if 50 <= i < len(rows) - 50 and int(row["flags"]) == CALM
            and places[i - 50] == places[i] == places[i + 50]]
    if len(held) < 200:
        fail(f"the tool was held still in only {len(held)} ticks")
    return held


def table(options):
    rows = read_table(options.file)
    touching = [i for i, row in enumerate(rows) if row["penetration_m"] > 0.0]
    if len(touching) < 200 or len(touching) != touching[-1] - touching[0] + 1:
        fail("the tool should touch the body once, for a while")
    if touching[0] < 50 or touching[-1] > len(rows) - 50:
        fail("the tool should be free in the beginning and in the end")
    free = rows[:touching[0]] + rows[touching[-1] + 1:]
    if any(row["force_n"] > 0.0 for row in free[:50] + free[-50:]):
        fail("a free tool should feel nothing")

    # The daemon's own promise: a tick may change the force by slew x dt, dt the time on its grid,
    # at most 5 ms; a single missed tick makes it two periods. Rows may be missing as well.
    worst = 0.0
    for a, b in zip(rows, rows[1:]):
        ticks = b["tick"] - a["tick"]
        time_s = b["time_s"] - a["time_s"]
        if ticks < 1 or time_s <= 0.0:
            fail("ticks and time should rise")
        step = norm([b[key] - a[key] for key in ("fx_n", "fy_n", "fz_n")])
        limit = options.slew * min(time_s + 0.001, 0.005 * ticks) * (1.0 + 1e-9)
        if step > limit:
            fail(f"the force changes by {step:g} N at {b['time_s']} s, more than {limit:g} N")
        worst = max(worst, step / ticks)

    # Where no limit acted the force is stiffness x penetration x (1 + 1.5 ratio u / v_ref), u the
    # depth's rate: at most the tool's own speed, whose peak is 15/8 of the mean of a leg.
    calm = [row for row in rows if int(row["flags"]) == CALM]
    if len(calm) < options.calm_min * len(touching):
        fail(f"a limit acted in {len(touching) - len(calm)} of {len(touching)} ticks of contact")
    share = 1.5 * options.ratio / options.reference_speed * 1.875 * options.speed + 1e-6
    for row in calm:
        spring_n = options.stiffness * row["penetration_m"]
        if abs(row["force_n"] - spring_n) > share * spring_n + 1e-9:
            fail(f"{row['force_n']:g} N at {row['time_s']} s is not within {100 * share:.3g} % of "
                 f"the spring's {spring_n:g} N")
    # Held still, the force is the spring's alone; the table has twelve digits.
    for row in held_rows(rows):
        spring_n = options.stiffness * row["penetration_m"]
        if abs(row["force_n"] - spring_n) > 1e-10 * spring_n:
            fail(f"held still, but {row['force_n']} N is not the spring's {spring_n} N")
    together = correlation([row["force_n"] for row in calm],
                           [row["penetration_m"] for row in calm])
    print(f"{len(rows)} rows, {len(touching)} in contact, {len(touching) - len(calm)} of them "
          f"flagged, at most {worst:.4f} N a tick, correlation of force and penetration "
          f"{together:.5f}")


def held(options):
    """The force by a way that knows neither daemon nor client: stiffness x penetration along the
    normal, both from `shcd query` at the tool's place in the frame of the body. The query is
    certain within 1e-9 of the diagonal, 0.1 nm, and so are the table's places; 300 N/m make less
    than 1e-7 N of that."""
    rows = held_rows(read_table(options.file))
    turn, turn_back = [0.0] * 3 + options.pose[3:], [0.0] * 3 + options.pose[3:4]
    turn_back += [-x for x in options.pose[4:]]
    places = [to_world(turn_back, [row[k + "_m"] - o for k, o in zip("xyz", options.pose)])
              for row in rows]
    worst_n = 0.0
    for row, near in zip(rows, query(options.shcd, options.body, places)):
        spring_n = options.stiffness * (options.radius - near["distance"])
        expected = [spring_n * n for n in to_world(turn, [near["n" + k] for k in "xyz"])]
        force = [row[key] for key in ("fx_n", "fy_n", "fz_n")]
        worst_n = max(worst_n, norm([f - e for f, e in zip(force, expected)]))
    if not (spring_n > 0.0 and worst_n <= 1e-6):
        fail(f"a held force differs from that of shcd query, {spring_n:g} N, by {worst_n:g} N")
    print(f"{len(rows)} held forces differ from {spring_n:.9f} N by shcd query by at most "
          f"{worst_n:.2g} N")


def junk(_options):
    import lcm
    from shcdmsg import tool_force_t
    whole = tool_force_t().encode()
    wrong = bytes(reversed(whole[:8])) + whole[8:]
    node = lcm.LCM()
    while True:
        for data in (b"", whole[:7], whole[:8], whole[:-1], wrong):
            node.publish("SHCD_FORCE", data)
        time.sleep(0.05)


def report(options):
    with open(options.file, encoding="utf8") as file:
        text = file.read()
    match = re.search(r"sent at ([\d.]+) Hz.*?([\d.]+) % answered\ndaemon +([\d.]+) ticks/s", text)
    if not match:
        fail(f"no figures in: {text}")
    sent_hz, answered, ticks = map(float, match.groups())
    # A pose may be replaced by a newer one before a tick looks, and both sides may be held up by
    # the machine: these bounds tell a loop at its rate from one at half of it, no more.
    if sent_hz < options.rate_min or ticks < options.rate_min or answered < 50.0:
        fail(f"{sent_hz} poses/s, {ticks} ticks/s, {answered} % answered")


def main():
    p = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    commands = p.add_subparsers(required=True)
    c = commands.add_parser("path")
    c.add_argument("shcd")
    c.add_argument("body")
    c.add_argument("side", choices=["x+", "x-", "y+", "y-", "z+", "z-"])
    c.add_argument("pose", type=lambda text: [float(part) for part in text.split(",")])
    c.set_defaults(run=path)
    c = commands.add_parser("table")
    c.add_argument("file")
    for name in ("stiffness", "ratio", "reference-speed", "speed", "slew"):
        c.add_argument("--" + name, type=float, required=True)
    c.add_argument("--calm-min", type=float, default=0.8)
    c.set_defaults(run=table)
    c = commands.add_parser("held")
    c.add_argument("shcd")
    c.add_argument("body")
    c.add_argument("pose", type=lambda text: [float(part) for part in text.split(",")])
    c.add_argument("file")
    c.add_argument("--radius", type=float, required=True)
    c.add_argument("--stiffness", type=float, required=True)
    c.set_defaults(run=held)
    c = commands.add_parser("junk")
    c.set_defaults(run=junk)
    c = commands.add_parser("report")
    c.add_argument("file")
    c.add_argument("--rate-min", type=float, required=True)
    c.set_defaults(run=report)
    options = p.parse_args()
    options.run(options)


if __name__ == "__main__":
    main()
