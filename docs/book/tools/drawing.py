"""Drawings as SVG: charts with two axes, and scenes in space."""

import math
from dataclasses import dataclass, field
from html import escape

INK, GREY, LIGHT = "#1c2733", "#6b7785", "#d9dee4"
BLUE, RED, GREEN, ORANGE = "#1f6feb", "#d1242f", "#1a7f37", "#bc6c00"
FONT = "font-family='Helvetica,Arial,sans-serif'"


def place(value: float) -> str:
    """A coordinate in px."""
    return f"{value:.1f}"


def points_of(points) -> str:
    """Points as an attribute."""
    return " ".join(f"{place(x)},{place(y)}" for x, y in points)


@dataclass
class Drawing:
    """Elements of an SVG picture with a white ground."""

    width: int
    height: int
    title: str
    elements: list[str] = field(default_factory=list)

    def add(self, element: str) -> None:
        self.elements.append(element)

    def text(self, x, y, words, size=13, colour=INK, anchor="start", extra="") -> None:
        self.add(
            f"<text x='{place(x)}' y='{place(y)}' font-size='{size}' fill='{colour}' text-anchor='{anchor}' {FONT} {extra}>"
            f"{escape(words)}</text>"
        )

    def line(self, points, colour=INK, width=1.5, dash="") -> None:
        dashed = f" stroke-dasharray='{dash}'" if dash else ""
        self.add(
            f"<polyline points='{points_of(points)}' fill='none' stroke='{colour}' stroke-width='{width}'"
            f" stroke-linejoin='round'{dashed}/>"
        )

    def area(self, points, colour, opacity=0.3, inner="") -> None:
        self.add(f"<polygon points='{points_of(points)}' fill='{colour}' fill-opacity='{opacity}'>{inner}</polygon>")

    def dots(self, points, colour, radius=2.0) -> None:
        for x, y in points:
            self.add(f"<circle cx='{place(x)}' cy='{place(y)}' r='{radius}' fill='{colour}'/>")

    def arrow(self, start, end, colour=INK, width=2.0) -> None:
        (x0, y0), (x1, y1) = start, end
        length = math.hypot(x1 - x0, y1 - y0) or 1.0
        ux, uy = (x1 - x0) / length, (y1 - y0) / length
        self.line([start, end], colour, width)
        head = [(x1, y1), (x1 - 8 * ux + 4 * uy, y1 - 8 * uy - 4 * ux), (x1 - 8 * ux - 4 * uy, y1 - 8 * uy + 4 * ux)]
        self.area(head, colour, 1)

    def svg(self) -> str:
        return "\n".join([
            f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {self.width} {self.height}' role='img'>",
            f"<title>{escape(self.title)}</title>",
            f"<rect width='{self.width}' height='{self.height}' fill='white'/>",
            *self.elements,
            "</svg>",
            "",
        ])


def ticks(low: float, high: float) -> list[float]:
    """About five round numbers between two."""
    rough = (high - low) / 5
    unit = 10 ** math.floor(math.log10(rough))
    step = next(unit * factor for factor in (1, 2, 5, 10) if unit * factor >= rough * 0.999)
    first = math.ceil(low / step - 1e-9)
    return [step * k for k in range(first, math.floor(high / step + 1e-9) + 1)]


def number(value: float) -> str:
    """A tick's words."""
    return f"{value:.6g}".replace("-", "−")


@dataclass
class Chart:
    """Two axes in a rectangle of a drawing."""

    drawing: Drawing
    box: tuple[float, float, float, float]
    x_range: tuple[float, float]
    y_range: tuple[float, float]
    log_y: bool = False

    def at(self, x: float, y: float) -> tuple[float, float]:
        left, top, width, height = self.box
        low, high = self.x_range
        y_low, y_high = (math.log10(v) for v in self.y_range) if self.log_y else self.y_range
        y = math.log10(y) if self.log_y else y
        return left + width * (x - low) / (high - low), top + height * (y_high - y) / (y_high - y_low)

    def axes(self, x_words: str, y_words: str) -> None:
        left, top, width, height = self.box
        draw = self.drawing
        for tick in ticks(*self.x_range):
            x, _ = self.at(tick, self.y_range[0])
            draw.line([(x, top), (x, top + height)], LIGHT, 1)
            draw.text(x, top + height + 16, number(tick), 11, GREY, "middle")
        for tick in self.y_ticks():
            _, y = self.at(self.x_range[0], tick)
            draw.line([(left, y), (left + width, y)], LIGHT, 1)
            draw.text(left - 6, y + 4, number(tick), 11, GREY, "end")
        draw.text(left + width / 2, top + height + 34, x_words, 12, INK, "middle")
        draw.text(left, top - 10, y_words, 12, INK)

    def y_ticks(self) -> list[float]:
        if not self.log_y:
            return ticks(*self.y_range)
        low, high = (math.log10(v) for v in self.y_range)
        return [10.0**k for k in range(math.ceil(low - 1e-9), math.floor(high + 1e-9) + 1)]

    def line(self, points, colour, width=1.5, dash="") -> None:
        self.drawing.line([self.at(x, y) for x, y in points], colour, width, dash)

    def dots(self, points, colour, radius=2.0) -> None:
        self.drawing.dots([self.at(x, y) for x, y in points], colour, radius)


@dataclass
class Eye:
    """Looks at points of space from above and from the side, in parallel projection; z is up."""

    azimuth_deg: float
    elevation_deg: float
    scale: float
    middle: tuple[float, float, float]
    centre: tuple[float, float]

    def at(self, point) -> tuple[float, float]:
        x, y, z = (p - m for p, m in zip(point, self.middle))
        a, e = math.radians(self.azimuth_deg), math.radians(self.elevation_deg)
        right = math.cos(a) * x + math.sin(a) * y
        away = -math.sin(a) * x + math.cos(a) * y
        up = math.cos(e) * z + math.sin(e) * away
        return self.centre[0] + self.scale * right, self.centre[1] - self.scale * up
