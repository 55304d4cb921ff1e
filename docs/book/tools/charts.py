"""Charts of what the program computes: each function simulates, calibrates and draws."""

import json
import math

from drawing import BLUE, GREEN, GREY, INK, ORANGE, RED, Chart, Drawing
from scan import calibrated, run, simulated, table

MOTIONS = (
    ("Along the line", ["--preset", "along-line"]),
    ("S-path, no tilt", ["--preset", "constant-attitude"]),
    ("S-path, hardly any tilt", ["--preset", "weak"]),
    ("S-path, ±25° about three axes", ["--preset", "good"]),
)
UNKNOWNS = (("time_offset_s", 1e3, "time offset, ms"), ("rotation_rad", 57.29577951, "rotation, °"), ("translation_mm", 1.0, "translation, mm"))


def worst(result: dict, key: str, factor: float) -> str:
    """The largest ± of an unknown."""
    values = (result["sigma_noise"] or {}).get(key)
    values = values if isinstance(values, list) else [values]
    return "undetermined" if None in values else f"± {factor * max(values):.2g}"


def observability(program, folder) -> str:
    """Four motions: the camera's way across the seam, its tilt, and what is visible."""
    draw = Drawing(760, 470, "Four motions and what each shows")
    for k, (name, words) in enumerate(MOTIONS):
        scan = simulated(program, folder / f"motion-{k}", *words)
        result = calibrated(program, scan, f"motion-{k}")
        robot = table(scan / "robot.csv")
        left, start = 60 + 175 * k, robot[0]["time_s"]
        every = robot[:: max(1, len(robot) // 300)]
        moved = Chart(draw, (left, 70, 150, 110), (0, robot[-1]["time_s"] - start), (-90, 90))
        moved.axes("time, s", "height of the tool, mm" if k == 0 else "")
        middle = sum(row["z_mm"] for row in every) / len(every)
        moved.line([(row["time_s"] - start, row["z_mm"] - middle) for row in every], BLUE)
        turned = Chart(draw, (left, 245, 150, 80), (0, robot[-1]["time_s"] - start), (-0.6, 0.6))
        turned.axes("time, s", "quaternion, change of x and y" if k == 0 else "")
        for part, colour in (("qx", ORANGE), ("qy", GREEN)):
            turned.line([(row["time_s"] - start, row[part] - robot[0][part]) for row in every], colour)
        draw.text(left, 32, name, 12, INK, extra="font-weight='bold'")
        seen = result["observability"]
        draw.text(left, 386, f"rank {seen['rank']} of {seen['size']}", 12)
        for row, (key, factor, words) in enumerate(UNKNOWNS):
            draw.text(left, 406 + 18 * row, f"{words}:", 11, GREY)
            draw.text(left + 86, 406 + 18 * row, worst(result, key, factor), 11, INK)
    return draw.svg()


def field_error(program, folder, name: str, simulated_with: list[str], calibrated_with: list[str]) -> float | None:
    """RMS distance from the true line, mm, that a calibration of one scan gives on another scan without noise; or none."""
    scan = simulated(program, folder / name, "--preset", "good", *simulated_with)
    pose = calibrated(program, scan, name, *calibrated_with)["tool_from_camera"]
    if None in (pose["translation_mm"], pose["rotation_wxyz"]) or None in pose["translation_mm"]:
        return None
    other = folder / "without-noise"
    if not other.exists():
        simulated(program, other, "--preset", "good", "--noise-free", "--seed", "2")
    figures = folder / f"{name}-error.json"
    run(program, "evaluate", other, "--quiet", "--calibration", folder / f"{name}.json", "--reference", other / "truth.toml", "--json", figures)
    return json.loads(figures.read_text())["figures"]["calibrated"]["rmse_mm"]


def straightness(program, folder) -> str:
    """Effect of the edge's straightness."""
    sizes = (0.0, 0.05, 0.1, 0.2)
    draw = Drawing(560, 330, "Error of seam points against how far the edge of the calibration was from straight")
    kinds = (("an even bow over 200 mm (sagitta)", "bow-height={}", BLUE), ("waves of about 50 mm (standard deviation)", "wobble={},50", RED))
    curves = []
    for k, (words, fault, colour) in enumerate(kinds):
        errors = [field_error(program, folder, f"edge-{k}-{n}", ["--fault", fault.format(size)] if size else [], []) for n, size in enumerate(sizes)]
        curves.append((words, [(size, error) for size, error in zip(sizes, errors) if error is not None], colour))
    highest = max(error for _, points, _ in curves for _, error in points)
    chart = Chart(draw, (70, 50, 450, 220), (0, sizes[-1]), (0, 1.15 * highest))
    chart.axes("out of straight, mm", "error of seam points afterwards, mm RMS")
    for k, (words, points, colour) in enumerate(curves):
        chart.line(points, colour, 2)
        chart.dots(points, colour, 3.5)
        draw.text(90, 70 + 18 * k, words, 12, colour)
    return draw.svg()


def collapse(program, folder) -> str:
    """The two residuals under outliers."""
    shares = (0.0, 0.01, 0.05, 0.1, 0.3)
    draw = Drawing(560, 330, "Error of seam points against the share of outliers, for the two residuals")
    chart = Chart(draw, (70, 50, 450, 220), (0, 30), (0.001, 1000), log_y=True)
    chart.axes("outliers, % of the features", "error of seam points, mm RMS")
    kinds = (("the paper's distance, least squares", ["--residual", "point-to-line", "--loss", "squared"], RED),
             ("the paper's distance, Huber", ["--residual", "point-to-line", "--loss", "huber"], ORANGE),
             ("in the laser plane, the default", [], BLUE))
    for k, (words, options, colour) in enumerate(kinds):
        errors = [field_error(program, folder, f"out-{k}-{n}", ["--outliers", str(share)], options) for n, share in enumerate(shares)]
        values = [(100 * share, error) for share, error in zip(shares, errors) if error is not None]
        chart.line(values, colour, 2)
        chart.dots(values, colour, 3.5)
        draw.text(300, 66 + 18 * k, words, 12, colour)
    return draw.svg()


def stamps(program, folder) -> str:
    """Stamps of arrival against an even rhythm."""
    draw = Drawing(560, 300, "Stamps of pictures against an even rhythm")
    scan = simulated(program, folder / "jitter", "--preset", "good", "--stamp-jitter-ms", "1.5")
    result = calibrated(program, scan, "jitter")
    found = result["stamps"]["features"]
    rows = table(scan / "features.csv")
    period = found["period_s"] or found["median_period_s"]
    late = [(row["frame"], 1e3 * (row["time_s"] - rows[0]["time_s"] - period * (row["frame"] - rows[0]["frame"]))) for row in rows]
    middle = sum(y for _, y in late) / len(late)
    chart = Chart(draw, (70, 50, 450, 190), (0, late[-1][0]), (-6, 6))
    chart.axes("number of the picture", "stamp less the even rhythm, ms")
    chart.dots([(x, y - middle) for x, y in late], BLUE, 1.6)
    jitter = 1e3 * (found["jitter_s"] or 0)
    draw.text(90, 66, f"measured jitter {jitter:.2f} ms, period {1e3 * period:.3f} ms; stamps used: {found['used']}", 12)
    return draw.svg()


def before_after(program, folder) -> str:
    """One scan of a seam placed with and without the time offset."""
    draw = Drawing(760, 330, "The same seam points with and without the time offset")
    scan = simulated(program, folder / "fast", "--preset", "good", "--seed", "3")
    other = simulated(program, folder / "fast-other", "--preset", "good", "--seed", "4")
    calibrated(program, scan, "fast")
    held = folder / "no-offset.toml"
    pose = json.loads((folder / "fast.json").read_text())["tool_from_camera"]
    held.write_text(f"time_offset_s = 0.0\n[tool_from_camera]\ntranslation_mm = {pose['translation_mm']}\nrotation_wxyz = {pose['rotation_wxyz']}\n")
    for k, (calibration, words, colour) in enumerate(((held, "stamps taken as they are", RED), (folder / "fast.json", "stamp − time offset", BLUE))):
        csv = folder / f"points-{k}.csv"
        run(program, "evaluate", other, "--quiet", "--calibration", calibration, "--reference", other / "truth.toml", "--csv", csv)
        rows = table(csv)
        chart = Chart(draw, (60 + 370 * k, 60, 300, 210), (0, 20), (-1.5, 1.5))
        chart.axes("time, s", "error in height, mm" if k == 0 else "")
        chart.dots([(row["time_s"], row["error_z_mm"]) for row in rows], colour, 1.4)
        rms = (sum(row["distance_mm"] ** 2 for row in rows) / len(rows)) ** 0.5
        draw.text(60 + 370 * k, 32, f"{words}: {rms:.3f} mm RMS from the line", 13, colour)
    return draw.svg()


def convergence(program, folder) -> str:
    """The steps of the solver from a guess, as in the paper's Fig. 6."""
    draw = Drawing(760, 320, "Time offset and distance from the line, step by step")
    scan = simulated(program, folder / "steps", "--preset", "paper")
    guess = folder / "guess.toml"
    lines = (scan / "truth.toml").read_text().split("[[lines]]")[0]
    guess.write_text("\n".join("time_offset_s = 0.0" if line.startswith("time_offset_s") else line for line in lines.splitlines()))
    steps = calibrated(program, scan, "steps", "--initial", guess, "--residual", "point-to-line")["iterations"]
    accepted = [step for step in steps if step["accepted"]]
    count = max(2, len(accepted) - 1)
    for k, (key, words, high) in enumerate((("time_offset_s", "time offset, ms", 25.0), ("rms_mm", "distance from the line, mm RMS", 1.0))):
        values = [(n, 1e3 * step[key] if k == 0 else step[key]) for n, step in enumerate(accepted)]
        top = high if k == 0 else 1.15 * max(value for _, value in values)
        chart = Chart(draw, (60 + 370 * k, 50, 300, 210), (0, count), (0, top))
        chart.axes("step", words)
        chart.line(values, BLUE, 2)
        chart.dots(values, BLUE, 3)
    return draw.svg()


def tilts(robot: list[dict[str, float]]) -> list[tuple[float, float, float]]:
    """The rotation vector from the first attitude, about the axes of base, degrees."""
    first = [robot[0][key] for key in ("qw", "qx", "qy", "qz")]
    found = []
    for row in robot:
        a, b = [row[key] for key in ("qw", "qx", "qy", "qz")], [first[0], -first[1], -first[2], -first[3]]
        w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
        x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
        y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]
        z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]
        length = math.sqrt(x * x + y * y + z * z)
        angle = 2 * math.degrees(math.atan2(length, w)) if w >= 0 else -2 * math.degrees(math.atan2(length, -w))
        found.append(tuple(angle * part / length if length else 0.0 for part in (x, y, z)))
    return found


def presets(program, folder, names: list[str]) -> str:
    """The motion of every preset: the way of the tool over time, and its tilt."""
    rows = -(-len(names) // 4)
    draw = Drawing(790, 40 + 300 * rows, "The motion of every preset")
    for k, name in enumerate(names):
        robot = table(simulated(program, folder / f"preset-{name}", "--preset", name) / "robot.csv")
        every = robot[:: max(1, len(robot) // 300)]
        start, end = robot[0]["time_s"], robot[-1]["time_s"]
        left, top = 62 + 186 * (k % 4), 50 + 300 * (k // 4)
        draw.text(left, top - 24, name, 13, INK, extra="font-weight='bold'")
        box = (left, top, 150, 100)
        moved = Chart(draw, box, (0, end - start), (-130, 130))
        moved.axes("", "tool x, y, z, mm" if k % 4 == 0 else "")
        for axis, colour in (("x_mm", BLUE), ("y_mm", ORANGE), ("z_mm", GREEN)):
            middle = sum(row[axis] for row in robot) / len(robot)
            moved.line([(row["time_s"] - start, row[axis] - middle) for row in every], colour)
        turned = Chart(draw, (left, top + 145, 150, 70), (0, end - start), (-60, 60))
        turned.axes("time, s", "tilt about x, y, z, °" if k % 4 == 0 else "")
        for axis, colour in enumerate((BLUE, ORANGE, GREEN)):
            turned.line([(row["time_s"] - start, tilt[axis]) for row, tilt in zip(every, tilts(every))], colour)
    return draw.svg()

SHOP = ("--shop", "ordinary", "--seed", "104")
STATED = (
    ("nothing is stated", []),
    ("the edge is sharp", ["--edge-radius-mm", "0"]),
    ("and the robot is good to 0.2 mm", ["--edge-radius-mm", "0", "--robot-accuracy-mm", "0.2"]),
)
PARTS = (
    ("robot", "the robot's accuracy", BLUE), ("edge_radius", "the radius of the edge", ORANGE), ("seam_form", "the form of the seam", GREEN),
    ("noise", "noise", GREY), ("detector", "the detector's bias", RED), ("sensor", "the sensor", INK),
)


def budget(program, folder) -> str:
    """The parts of the ± of a seam point, by what is stated of the cell."""
    draw = Drawing(760, 330, "What the ± of a seam point is made of, by what is stated of the cell")
    scan = simulated(program, folder / "shop", *SHOP)
    for k, (words, options) in enumerate(STATED):
        error = calibrated(program, scan, f"shop-{k}", *options)["seam_error"]
        top, left = 40 + 92 * k, 40
        draw.text(left, top - 8, f"{words}: ± {error['rms_mm']:.2f} mm", 14, INK, extra="font-weight='bold'")
        # The parts add up by their squares: the area of a piece is its share of the variance.
        for key, _, colour in PARTS:
            width = 680 * (error["budget_mm"][key] / error["rms_mm"]) ** 2
            draw.area([(left, top), (left + width, top), (left + width, top + 40), (left, top + 40)], colour, 0.85)
            if width > 60:
                draw.text(left + 6, top + 25, f"{error['budget_mm'][key]:.2f} mm", 12, "white")
            left += width
    for k, (_, words, colour) in enumerate(PARTS):
        x, y = 40 + 230 * (k % 3), 300 + 20 * (k // 3)
        draw.dots([(x, y - 4)], colour, 5)
        draw.text(x + 12, y, words, 12)
    return draw.svg()
