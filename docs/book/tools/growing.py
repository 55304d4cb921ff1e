"""A film of a scan that grows, and of the answer that grows with it: the program calibrates the scan up to each moment."""

import csv
import shutil

from drawing import BLUE, GREEN, GREY, INK, ORANGE, RED, Chart, Drawing, Eye
from scan import Scene, calibrated, table
from scenes import fan, plates, sensor_box

MOMENTS_S = (1, 2, 3, 4, 5, 6, 8, 10, 12, 14, 16, 18, 20)
SHOWN_S, LAST_S = 0.8, 4.0
# Poses go on for as long as pictures are late.
LATE_S = 0.3
CURVES = (
    ("time_offset_s", 1e3, "time offset, ms", BLUE),
    ("rotation_rad", 57.29577951, "rotation, °", ORANGE),
    ("translation_mm", 1.0, "translation, mm", GREEN),
)


def until(scan, folder, seconds: float):
    """The scan up to a moment, as a dataset of its own."""
    folder.mkdir()
    shutil.copy(scan / "sensor.toml", folder)
    start = table(scan / "robot.csv")[0]["time_s"]
    for name, late_s in (("robot.csv", LATE_S), ("features.csv", 0.0)):
        with (scan / name).open() as source, (folder / name).open("w") as file:
            rows = csv.reader(source)
            written = csv.writer(file, lineterminator="\n")
            written.writerow(next(rows))
            written.writerows(row for row in rows if float(row[0]) <= start + seconds + late_s)
    return folder


def worst(result: dict, key: str, factor: float) -> float | None:
    """The largest random ± of an unknown; none if a part of it is not determined."""
    values = (result["sigma_noise"] or {}).get(key)
    values = values if isinstance(values, list) else [values]
    return None if None in values else factor * max(values)


def words_of(result: dict) -> tuple[str, str, str]:
    """The knowledge at a moment, in two lines and a colour."""
    if result["status"] != "accepted":
        codes = ", ".join(dict.fromkeys(fact["code"] for fact in result["reasons"]))
        return "not accepted:", codes, RED
    offset, shift = worst(result, "time_offset_s", 1e3), worst(result, "translation_mm", 1.0)
    return f"time offset {1e3 * result['time_offset_s']:.2f} ± {offset:.2f} ms", f"hand-eye ± {shift:.2f} mm, worst axis", GREEN


def scene_at(draw: Drawing, scene: Scene, eye: Eye, row: int) -> None:
    """The sensor where it is, and the way it came."""
    draw.line([eye.at(scene.in_base(k, [0, 0, 0])) for k in range(0, row + 1, 40)], BLUE, 1.2)
    draw.area([eye.at(point) for point in fan(scene, row)], RED, 0.35)
    front, back = sensor_box(scene, row, eye)
    draw.area(back, "#4a5a6a", 0.9)
    draw.area([front[1], front[2], back[2], back[1]], "#6b7b8c", 0.9)
    draw.area(front, "#2c3947", 0.9)


def moment(draw: Drawing, number: int) -> tuple[str, str]:
    """Begin and end of the elements that show one moment; without animation the last one stands."""
    shown = len(MOMENTS_S) * SHOWN_S + LAST_S
    begin, end = number * SHOWN_S / shown, (number + 1) * SHOWN_S / shown
    last = number == len(MOMENTS_S) - 1
    times, values = (f"0;{begin:.4f}", "0;1") if last else (f"0;{begin:.4f};{end:.4f}", "0;1;0")
    if number == 0:
        times, values = f"0;{end:.4f}", "1;0"
    animate = f"<animate attributeName='opacity' calcMode='discrete' dur='{shown}s' repeatCount='indefinite' keyTimes='{times}' values='{values}'/>"
    return f"<g opacity='{int(last)}'>{animate}", "</g>"


def film(program, folder, scan) -> str:
    """The scan on the left; on the right the ± of the answer from what was scanned so far."""
    draw = Drawing(860, 360, "A scan grows, and with it the answer")
    scene, eye = Scene(scan), Eye(18, 28, 1.35, (1170, 85, 195), (225, 190))
    plates(scene, draw, eye, (-125, 125))
    chart = Chart(draw, (500, 50, 320, 190), (0, MOMENTS_S[-1]), (0.01, 100), log_y=True)
    chart.axes("scanned so far, s", "random ± (worst axis)")
    results = [calibrated(program, until(scan, folder / f"until-{seconds}", seconds), f"until-{seconds}") for seconds in MOMENTS_S]
    robot = scene.robot
    for number, seconds in enumerate(MOMENTS_S):
        begin, end = moment(draw, number)
        draw.add(begin)
        row = max(k for k, pose in enumerate(robot) if pose["time_s"] <= robot[0]["time_s"] + seconds)
        scene_at(draw, scene, eye, row)
        for key, factor, _, colour in CURVES:
            known = [(s, worst(result, key, factor)) for s, result in zip(MOMENTS_S[: number + 1], results)]
            known = [(s, value) for s, value in known if value is not None]
            chart.line(known, colour, 2)
            chart.dots(known, colour, 3)
        first, second, colour = words_of(results[number])
        draw.text(500, 306, f"{seconds} s: {first}", 15, colour, extra="font-weight='bold'")
        draw.text(500, 328, second, 13, INK)
        draw.add(end)
    for k, (_, _, words, colour) in enumerate(CURVES):
        draw.text(700, 70 + 17 * k, words, 12, colour)
    draw.text(14, 24, "Simulated scan (preset good): sensor, laser plane (red), way of the camera (blue), seam (black)", 12, GREY)
    return draw.svg()
