"""Drawings in space of a simulated scan: the frames, and a film of the motion."""

from drawing import BLUE, GREEN, GREY, INK, ORANGE, RED, Drawing, Eye, points_of
from scan import Scene, plus, turn

FRAMES_PER_FILM = 60
FILM_S = 12


def plates(scene: Scene, draw: Drawing, eye: Eye, spans, rise_mm=45.0) -> None:
    """The two plates of a fillet along the line, as a valley."""
    ends = [plus(scene.point, scene.direction, along) for along in spans]
    for side, colour in ((1, "#9aa7b5"), (-1, "#b9c3cd")):
        across = [-scene.direction[1] * side * rise_mm, scene.direction[0] * side * rise_mm, rise_mm]
        corners = [ends[0], ends[1], plus(ends[1], across), plus(ends[0], across)]
        draw.area([eye.at(corner) for corner in corners], colour, 0.55)
    draw.line([eye.at(end) for end in ends], INK, 2.5)


def fan(scene: Scene, row: int) -> list[list[float]]:
    """The laser plane between the sensor and the stripe: the sensor, the stripe's first end, the seam point, its second end."""
    camera, hit = scene.in_base(row, [0, 0, 0]), scene.seam_hit(row)
    right = plus(scene.in_base(row, [1, 0, 0]), camera, -1)
    back = plus(camera, hit, -1)
    rise = 28.0 / sum(part * part for part in back) ** 0.5
    first, second = (plus(plus(hit, right, 30.0 * side), back, rise) for side in (-1, 1))
    return [camera, first, hit, second]


def sensor_box(scene: Scene, row: int, eye: Eye):
    """Outline of a small box behind the camera, on paper."""
    size = 14.0
    corners = [(-size, -size, 0), (size, -size, 0), (size, size, 0), (-size, size, 0)]
    front = [eye.at(scene.in_base(row, list(c))) for c in corners]
    back = [eye.at(scene.in_base(row, [c[0], c[1], -45.0])) for c in corners]
    return front, back


def animated(states: list[str]) -> str:
    """An animation of the points of a polygon."""
    return f"<animate attributeName='points' dur='{FILM_S}s' repeatCount='indefinite' values='{';'.join(states)}'/>"


def film(scene: Scene) -> str:
    """The sensor on its way along the seam, there and back in a loop."""
    draw = Drawing(760, 380, "The sensor sweeps, tilts and changes its distance while it moves along the seam")
    eye = Eye(18, 28, 1.5, (1170, 85, 195), (380, 200))
    plates(scene, draw, eye, (-125, 125))
    count = len(scene.robot) - 1
    rows = [round(count * k / FRAMES_PER_FILM) for k in range(FRAMES_PER_FILM + 1)]
    path = [eye.at(scene.in_base(row, [0, 0, 0])) for row in range(0, count, max(1, count // 500))]
    draw.line(path, "#c3d4ee", 1)
    rows += rows[-2:0:-1]
    parts = {"front": [], "back": [], "fan": [], "left": [], "right": []}
    for row in rows:
        front, back = sensor_box(scene, row, eye)
        parts["fan"].append([eye.at(point) for point in fan(scene, row)])
        parts["front"].append(front)
        parts["back"].append(back)
        parts["left"].append([front[0], front[3], back[3], back[0]])
        parts["right"].append([front[1], front[2], back[2], back[1]])
    looks = {"fan": (RED, 0.35), "back": ("#4a5a6a", 0.9), "left": ("#6b7b8c", 0.9), "right": ("#6b7b8c", 0.9), "front": ("#2c3947", 0.9)}
    for name, (colour, opacity) in looks.items():
        draw.area(parts[name][0], colour, opacity, animated([points_of(points) for points in parts[name]]))
    draw.text(14, 24, "Sensor (grey), laser plane (red), path of the camera (blue), seam (black)", 13)
    draw.text(14, 366, "20 s of the preset good, shown at about three times its speed", 12, GREY)
    return draw.svg()


def axes(draw: Drawing, eye: Eye, origin, to_base, name: str, length=38.0, dx=8, dy=-8) -> None:
    """The three axes of a frame and its name."""
    for axis, colour in (((1, 0, 0), RED), ((0, 1, 0), GREEN), ((0, 0, 1), BLUE)):
        tip = plus(origin, to_base([length * part for part in axis]))
        draw.arrow(eye.at(origin), eye.at(tip), colour)
    x, y = eye.at(origin)
    draw.text(x + dx, y + dy, name, 15, INK, extra="font-weight='bold'")


def frames(scene: Scene) -> str:
    """Tool, camera, laser plane, line and base of the simulated cell."""
    draw = Drawing(760, 470, "The frames: base, tool, camera; the laser plane and the line")
    eye = Eye(18, 22, 1.45, (1190, 90, 235), (430, 248))
    row = len(scene.robot) // 2
    plates(scene, draw, eye, (-125, 125))
    position, q = scene.tool(row)
    camera = scene.in_base(row, [0, 0, 0])
    hit = scene.seam_hit(row)
    corners = [eye.at(point) for point in fan(scene, row)]
    draw.area(corners, RED, 0.25)
    draw.line([eye.at(camera), eye.at(hit)], ORANGE, 1.5, "5 4")
    draw.dots([eye.at(hit)], ORANGE, 5)
    draw.line([eye.at(position), eye.at(camera)], GREY, 1.5, "3 3")
    axes(draw, eye, position, lambda p: turn(q, p), "tool")
    axes(draw, eye, camera, lambda p: turn(q, turn(scene.rotation, p)), "camera", 32, 14, -10)
    base = [1045.0, 20.0, 110.0]
    axes(draw, eye, base, lambda p: p, "base (axes only: its origin is in the robot's foot)", 42, 6, 22)
    x, y = eye.at(hit)
    draw.text(x + 10, y + 22, "seam point", 13, ORANGE)
    x, y = corners[1]
    draw.text(x - 10, y + 18, "laser plane", 13, RED, "end")
    x, y = eye.at(plus(scene.point, scene.direction, 118))
    draw.text(x - 4, y + 20, "line", 13)
    first, second = eye.at(position), eye.at(camera)
    draw.text((first[0] + second[0]) / 2 + 16, (first[1] + second[1]) / 2 + 4, "tool_from_camera (hand-eye)", 13, GREY)
    draw.text(14, 24, "Axes: x red, y green, z blue. Drawn from one simulated scan (preset good).", 12, GREY)
    return draw.svg()
