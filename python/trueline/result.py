"""Result of a scan."""

from __future__ import annotations

import html
import json
import os
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _trueline
from .estimates import Covariance, Curve, Fact, Line, Plane, Residuals, Sigma
from .names import text_of
from .page import Page, framed
from .result_json import curve_of, facts_of, number_of, numbers_of, sigma_of
from .rotations import matrices_of
from .sensor import SensorText

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .plots import Quantity


class Result:
    """A calibration: estimates with their uncertainty, and whether to use them.

    Read from a file by :func:`load`, or made by :func:`calibrate`; only then it has ``residuals`` and a report.
    """

    def __init__(self, text: str, made_from: _trueline.Calibration | None = None) -> None:
        self._text = text
        self._made_from = made_from
        document = json.loads(text)
        if not isinstance(document, dict) or "tool_from_camera" not in document:
            raise ValueError("this is no result of trueline: it has no tool_from_camera")
        self.document: dict[str, Any] = document

    def __reduce__(self) -> tuple[type[Result], tuple[str]]:
        """Copies and pickles are as if read from its file: without residuals and report."""
        return type(self), (self._text,)

    @classmethod
    def of(cls, calibration: _trueline.Calibration) -> Result:
        """The result of a calibration that was just made."""
        return cls(calibration.json(), calibration)

    @property
    def accepted(self) -> bool:
        """Whether it can be used."""
        return bool(self.document.get("status") == "accepted")

    @property
    def status(self) -> str | None:
        """``accepted`` or ``not_accepted``."""
        status: str | None = self.document.get("status")
        return status

    @cached_property
    def reasons(self) -> list[Fact]:
        """Why it is not accepted; empty if it is."""
        return facts_of(self.document.get("reasons", []))

    @cached_property
    def warnings(self) -> list[Fact]:
        """Usable, but look here."""
        return facts_of(self.document.get("warnings", []))

    @property
    def time_offset_s(self) -> float | None:
        """The image stamped t was exposed at t minus this, s; ``None`` if the scan does not show it."""
        offset: float | None = self.document.get("time_offset_s")
        return offset

    @cached_property
    def tool_from_camera(self) -> NDArray[np.float64]:
        """The hand-eye transform: camera coordinates to tool coordinates, 4×4, m; NaN if the scan
        does not determine it."""
        entry = self.document["tool_from_camera"]
        pose = np.eye(4)
        quaternion = entry.get("rotation_wxyz")
        pose[:3, :3] = np.nan if quaternion is None else matrices_of(quaternion)
        pose[:3, 3] = numbers_of(entry["translation_mm"], 3) * 1e-3
        return pose

    @cached_property
    def sigma(self) -> Sigma:
        """Standard deviations of everything that is accounted for."""
        return sigma_of(self.document.get("sigma", {}))

    @cached_property
    def sigma_noise(self) -> Sigma:
        """The random part of it: noise of features, robot and stamps."""
        return sigma_of(self.document.get("sigma_noise", {}))

    @cached_property
    def covariance(self) -> Covariance:
        """Covariance of everything estimated, with names; NaN for what has no sigma."""
        entry = self.document.get("covariance", {})
        names = list(entry.get("order", []))
        rows = [numbers_of(row, len(names)) for row in entry.get("matrix", [])]
        return Covariance(names, np.array(rows).reshape(len(rows), len(names)))

    @cached_property
    def lines(self) -> list[Line]:
        """The lines in base."""
        return [
            Line(line["label"], numbers_of(line["point_mm"], 3) * 1e-3, numbers_of(line["direction"], 3))
            for line in self.document.get("lines", [])
        ]

    @cached_property
    def curves(self) -> list[Curve]:
        """The curves in base, where no straight line explains the scan; else empty."""
        return [curve_of(curve) for curve in self.document.get("curves", [])]

    @cached_property
    def planes(self) -> list[Plane]:
        """The plates in base, where whole stripes were used; else empty."""
        return [
            Plane(
                label=plane["label"],
                normal=numbers_of(plane["normal"], 3),
                offset_m=number_of(plane["offset_mm"]) * 1e-3,
                sigma_rad=float(np.radians(number_of(plane["sigma_deg"]))),
                sigma_m=number_of(plane["sigma_mm"]) * 1e-3,
                bow_m=plane["bow_mm"] * 1e-3,
            )
            for plane in self.document.get("planes", [])
        ]

    @property
    def stripes(self) -> dict[str, Any] | None:
        """Use of the whole stripes, with the answers of seam points and stripes side by side;
        ``None`` if there are none."""
        stripes: dict[str, Any] | None = self.document.get("stripes")
        return stripes

    @property
    def seam_error_mm(self) -> float | None:
        """Error of a seam point measured later, RMS over the working field, one standard deviation,
        mm."""
        entry = self.document.get("seam_error")
        return None if entry is None else entry["rms_mm"]

    @property
    def rivals(self) -> list[dict[str, Any]]:
        """Answers that the scan cannot separate from this one."""
        rivals: list[dict[str, Any]] = self.document.get("rivals", [])
        return rivals

    @cached_property
    def residuals(self) -> Residuals:
        """The residuals.

        Raises
        ------
        ValueError
            For a result that was read from a file.
        """
        return Residuals(**self._calibration("residuals").residuals())

    @cached_property
    def corrected_sensor(self) -> SensorText | None:
        """The sensor as the scan corrects it, what ``--write-sensor`` writes; ``None`` if nothing was corrected.

        ``tool_from_camera`` belongs to the stated sensor file. With this one calibrate again.

        Raises
        ------
        ValueError
            For a result that was read from a file.
        """
        text = self._calibration("corrected sensor").corrected_sensor_toml()
        return None if text is None else SensorText(text)

    @property
    def took_s(self) -> float:
        """Duration of the estimate, s; reading, and making this object, not included.

        Raises
        ------
        ValueError
            For a result that was read from a file.
        """
        return self._calibration("duration").took_s()

    def report(self) -> Page:
        """The report with all its charts as a page of HTML, which a notebook shows; about 1 MB.

        Raises
        ------
        ValueError
            For a result that was read from a file.
        """
        return Page(self._calibration("report").report_html())

    def summary(self) -> str:
        """The summary in words."""
        return self._made_from.summary() if self._made_from else _short(self)

    def json(self) -> str:
        """The text of its file: what ``trueline calibrate --json`` writes."""
        return self._text

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the file of the result; it appears whole or not at all."""
        target = Path(path)
        unfinished = target.with_name(f"{target.name}.{os.getpid()}.unfinished")
        try:
            unfinished.write_text(self._text.rstrip() + "\n", encoding="utf-8")
            unfinished.replace(target)
        finally:
            unfinished.unlink(missing_ok=True)

    def plot_residuals(self, ax: Axes | None = None) -> Axes:
        """Residuals over time in standard deviations (needs matplotlib)."""
        from .plots import residuals_over_time

        return residuals_over_time(self.residuals, ax)

    def plot_convergence(self, ax: Axes | None = None, of: Quantity = "time offset") -> Axes:
        """Distance of a quantity from its end value after every step of the solver (needs
        matplotlib): ``"time offset"`` and ``"distance"`` are the paper's Fig. 6, ``"line"`` is Fig.
        7, ``"translation"`` and ``"rotation"`` are Fig. 8."""
        from .plots import convergence

        return convergence(self.document["iterations"], of, ax)

    def plot_covariance(self, ax: Axes | None = None) -> Axes:
        """Correlations of everything estimated (needs matplotlib)."""
        from .plots import correlations

        return correlations(self.covariance, ax)

    def __str__(self) -> str:
        return self.summary()

    def __repr__(self) -> str:
        return f"<trueline.Result: {_short(self)}>"

    def _repr_html_(self) -> str:
        if self._made_from is None:
            return f"<pre>{html.escape(self.summary())}</pre>"
        # Notebooks store their output, so charts are drawn on request only.
        return framed(self._made_from.brief_html(), "600px") + "<p>With all charts: <code>.report()</code></p>"

    def _calibration(self, what: str) -> _trueline.Calibration:
        if self._made_from is None:
            raise ValueError(f"a result that was read from a file has no {what}: calibrate the recording again")
        return self._made_from


def load(path: str | os.PathLike[str]) -> Result:
    """Read the result that :meth:`Result.save` or ``trueline calibrate --json`` wrote."""
    text = text_of(path, EXPECTED)
    try:
        return Result(text)
    except json.JSONDecodeError as error:
        raise ValueError(f"{path}: is no JSON ({error}); expected {EXPECTED}") from error
    except ValueError as error:
        raise ValueError(f"{path}: {error}; expected {EXPECTED}") from error


EXPECTED = "a result that Result.save or `trueline calibrate --json` wrote"


def _short(result: Result) -> str:
    verdict = "accepted" if result.accepted else "NOT accepted"
    offset = result.time_offset_s
    if offset is None:
        return f"{verdict}, time offset not observable"
    sigma = result.sigma.time_offset_s
    plus_minus = "" if sigma is None else f" ± {sigma * 1e3:.2g}"
    return f"{verdict}, time offset {offset * 1e3:.4g}{plus_minus} ms"
