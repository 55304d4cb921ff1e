"""Charts for the pages of the theory: each function simulates, calibrates and draws."""

import csv

from drawing import BLUE, GREEN, GREY, INK, LIGHT, ORANGE, RED, Chart, Drawing
from scan import calibrated, run, simulated, table, toml

NOISE_ONLY = ("--sensor", "fixed", "--robot-accuracy-mm", "0", "--feature-bias-px", "0", "--edge-radius-mm", "0", "--waviness-mm", "0")
WAYS = (
    ("trueline", BLUE, ""),
    ("joint, paper's residual", GREEN, ""),
    ("blocks, signs corrected", ORANGE, ""),
    ("blocks, as published", RED, "5 4"),
)
DEGREES = 57.29577951
# Scans of the chart of stripes against seam points, poor ones first.
SCANS = (
    ("S-scan, 20 s", ("--preset", "paper", "--duration-s", "20")),
    ("S-scan, 60 s", ("--preset", "paper")),
    ("±25° about three axes, 20 s", ("--preset", "good")),
)


def blocks(program, folder) -> str:
    """Joint steps and steps block by block from the paper's start."""
    out = folder / "ways"
    run(program, "reproduce", "--quiet", "--repeats", "1", "--out", out)
    with (out / "convergence.csv").open() as lines:
        rows = list(csv.DictReader(lines))
    draw = Drawing(760, 330, "Joint steps converge in a dozen, steps block by block do not in 80")
    for k, (key, words, span, log) in enumerate((("rms_mm", "distance from the line, mm RMS", (0.01, 100), True), ("time_offset_ms", "time offset, ms (true: 17.73)", (0, 40), False))):
        chart = Chart(draw, (60 + 370 * k, 60, 300, 200), (0, 80), span, log_y=log)
        chart.axes("step", words)
        for method, colour, dash in WAYS:
            way = [(float(row["step"]), float(row[key])) for row in rows if row["method"] == method and row[key]]
            chart.line(way, colour, 1.8, dash)
    for k, (words, colour, _) in enumerate(WAYS):
        draw.text(60 + 178 * k, 24, words, 12, colour)
    return draw.svg()


def honest(program, folder) -> str:
    """Estimates of the time offset from 16 scans with their intervals."""
    count = 16
    draw = Drawing(760, 280, "Time offsets of 16 simulated scans with their 95 % intervals")
    chart = Chart(draw, (60, 50, 660, 170), (0, count + 1), (-80, 80))
    chart.axes("simulated scan", "error of the time offset, µs")
    held = 0
    for seed in range(1, count + 1):
        scan = simulated(program, folder / f"honest-{seed}", "--preset", "good", "--seed", str(seed))
        result = calibrated(program, scan, f"honest-{seed}", *NOISE_ONLY)
        error = 1e6 * (result["time_offset_s"] - toml(scan / "truth.toml")["time_offset_s"])
        half = 1.96e6 * result["sigma"]["time_offset_s"]
        inside = abs(error) <= half
        held += inside
        colour = BLUE if inside else RED
        chart.line([(seed, error - half), (seed, error + half)], colour, 2)
        chart.dots([(seed, error)], colour, 3.5)
    chart.line([(0, 0), (count + 1, 0)], INK, 1)
    draw.text(60, 24, f"{held} of {count} intervals hold the truth", 13)
    return draw.svg()


def in_picture(draw: Drawing, scan) -> None:
    """The support points of one picture and of all others, and the seam point."""
    stripes, features = table(scan / "stripes.csv"), table(scan / "features.csv")
    chosen = features[len(features) // 2]
    box = (60, 50, 290, 210)
    chart = Chart(draw, box, (500, 2000), (-1100, -700))
    chart.axes("u, px", "v, px (downwards)")
    for row in (row for row in stripes if row["frame"] % 5 == 0):
        chart.line([(row["u1_px"], -row["v1_px"]), (row["u2_px"], -row["v2_px"])], LIGHT, 1)
    for row, colour in zip((row for row in stripes if row["frame"] == chosen["frame"]), (BLUE, GREEN)):
        ends = [(row["u1_px"], -row["v1_px"]), (row["u2_px"], -row["v2_px"])]
        near = min(ends, key=lambda end: abs(end[0] - chosen["u_px"]))
        chart.line([near, (chosen["u_px"], -chosen["v_px"])], colour, 1.2, "4 4")
        chart.line(ends, colour, 3)
        chart.dots(ends, colour, 4.5)
    chart.dots([(chosen["u_px"], -chosen["v_px"])], RED, 4.5)
    draw.text(60, 24, "one picture: four support points, one crossing (red)", 12)


def stripe(program, folder) -> str:
    """The content of a picture, and the stripes' gain for the rotation."""
    draw = Drawing(760, 320, "Support points of both stripes in a picture, and the rotation that scans show with and without them")
    chart = Chart(draw, (430, 50, 290, 210), (0, len(SCANS)), (0.001, 10), log_y=True)
    for tick in chart.y_ticks():
        chart.line([(0, tick), (len(SCANS), tick)], LIGHT, 1)
        x, y = chart.at(0, tick)
        draw.text(x - 6, y + 4, f"{tick:g}", 11, GREY, "end")
    for k, (words, asked) in enumerate(SCANS):
        scan = simulated(program, folder / f"stripe-{k}", *asked, "--plates")
        if k == 0:
            in_picture(draw, scan)
        found = calibrated(program, scan, f"stripe-{k}", *NOISE_ONLY)["stripes"]
        for side, (answer, colour) in enumerate((("seam_answer", RED), ("stripe_answer", BLUE))):
            value = DEGREES * max(found[answer]["sigma"]["rotation_rad"])
            left, right = k + 0.12 + 0.38 * side, k + 0.46 + 0.38 * side
            draw.area([chart.at(left, 0.001), chart.at(right, 0.001), chart.at(right, value), chart.at(left, value)], colour, 0.85)
            x, y = chart.at((left + right) / 2, value)
            draw.text(x, y - 5, f"{value:.2g}°", 11, INK, "middle")
        x, y = chart.at(k + 0.5, 0.001)
        draw.text(x, y + 16 + 16 * (k % 2), words, 10, GREY, "middle")
    draw.text(430, 24, "± of the rotation, worst axis:", 12)
    draw.text(600, 24, "seam points", 12, RED)
    draw.text(680, 24, "stripes", 12, BLUE)
    return draw.svg()
