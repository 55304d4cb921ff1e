"""The eight tracks: which cases each holds, and how large everything is in a sequence."""

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from .clock import Lateness
from .recipe import Recipe

Case: TypeAlias = Callable[[np.random.Generator], dict[str, Any]]
TIERS = {"smoke": 2, "small": 8, "medium": 48}
"""Sequences for each track."""
SENSORS = ("profiler", "camera_laser", "points")


def recipe(track: str, index: int, rng: np.random.Generator) -> Recipe:
    """The recipe of one sequence. Cases take turns, so that small tiers hold as many of them as they can."""
    cases = TRACKS[track]
    name = list(cases)[index % len(cases)]
    common: dict[str, Any] = {
        "case": name,
        "sensor": SENSORS[(index + index // len(cases)) % 3],
        "motion": str(rng.choice(["planned", "planned", "hand", "taught"])),
        "time_offset_s": float(rng.uniform(-0.03, 0.12)),
        "noise_px": float(rng.uniform(0.2, 0.4)),
        "noise_mm": float(rng.uniform(0.008, 0.02)),
        "feature_hz": float(rng.choice([30.0, 40.0, 50.0])),
        "robot_hz": float(rng.choice([125.0, 250.0])),
        "length_mm": float(rng.uniform(180, 320)),
        "accuracy_mm": 0.0,
    }
    return Recipe(**(common | cases[name](rng)))


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _noise(px: float, mm: float, **more: Any) -> Case:
    return lambda rng: {"noise_px": px, "noise_mm": mm, **more}


def _motion(kind: str, duration_s: float, **more: Any) -> Case:
    return lambda rng: {"motion": kind, "duration_s": duration_s, **more}


def _clocks(features: Lateness, robot: Lateness | None = None, **more: Any) -> Case:
    return lambda rng: {"feature_clock": features, "robot_clock": robot or features, **more}


def _set(**values: Any) -> Case:
    return lambda rng: values


PC = Lateness(half_normal_s=0.00012, tail_share=0.005)
"""An ordinary PC on an ordinary network."""


def _everything(rng: np.random.Generator) -> dict[str, Any]:
    """A shop in which everything errs at once; medians as they are usual."""

    def size(typical: float) -> float:
        return float(typical * np.exp(rng.normal(0, 0.4)))

    def chance(probability: float) -> bool:
        return bool(rng.random() < probability)

    clock = Lateness(
        half_normal_s=size(0.00012), tail_share=0.005, stall_every_s=8.0 if chance(0.35) else 0.0,
        lost_share=0.01, drift_ppm=float(rng.normal(0, 20)), rounding_s=0.001 if chance(0.08) else 0.0,
    )  # fmt: skip
    return {
        "duration_s": float(rng.uniform(12, 22)), "feature_clock": clock, "robot_clock": clock,
        "student_dof": 6.0, "spatter": 0.015, "clusters": 0.03, "other_edge": 0.05 if chance(0.4) else 0.0,
        "intrinsics": size(1), "plane": size(1), "shape": size(1), "linearity_mm": size(0.015),
        "bend_mm": size(0.1) if chance(0.15) else 0.0, "bias_per_rad": size(1.0),
        "edge_radius_mm": size(0.25) if chance(0.6) else 0.0, "stated": chance(0.5),
        "exposure_wander_s": size(0.0003) if chance(0.3) else 0.0,
        "accuracy_mm": size(0.4), "state_accuracy": chance(0.5), "ripple_arcsec": size(5), "hysteresis_arcsec": size(3),
        "sag_arcsec": size(10), "mean_filter_s": float(rng.uniform(0.008, 0.04)) if chance(0.3) else 0.0,
        "lag_s": size(0.025) if chance(0.12) else 0.0, "quantised_mm": 0.01, "quantised_deg": 0.001,
        "bow_mm": size(0.12), "wavy_mm": size(0.03), "kink_mm": size(0.06),
        "tacks_mm": size(0.5) if chance(0.3) else 0.0, "noise_px": size(0.35), "noise_mm": size(0.018),
    }  # fmt: skip


TRACKS: dict[str, dict[str, Case]] = {
    "noise": {
        "low": _noise(0.05, 0.003),
        "usual": _noise(0.3, 0.015),
        "high": _noise(1.0, 0.06),
        "heavy-tails": _noise(0.4, 0.02, student_dof=4.0),
        "slow": _noise(0.2, 0.01, correlated=1.5),
        "noisy-poses": _noise(0.3, 0.015, robot_noise_mm=0.05, robot_noise_deg=0.004),
        "very-high": _noise(2.5, 0.15, duration_s=25.0),
        "coarse-poses": _noise(0.3, 0.015, quantised_mm=0.05, quantised_deg=0.005),
    },
    "motion": {
        "planned": _motion("planned", 12.0),
        "s-scan": _motion("s-scan", 40.0, length_mm=400.0),
        "short": _motion("planned", 5.0, length_mm=120.0),
        "fast": _motion("fast", 10.0),
        "small-tilts": _motion("small-tilts", 20.0),
        "one-axis": _motion("one-axis", 15.0),
        "weave": _motion("weave", 15.0),
        "fixed-attitude": _motion("fixed-attitude", 15.0),
        "taught": _motion("taught", 20.0),
        "hand": _motion("hand", 20.0),
        "still-feature": _motion("still-feature", 15.0),
    },
    "time": {
        "jitter": _clocks(Lateness(half_normal_s=0.0005, tail_share=0.02)),
        "stalls": _clocks(Lateness(half_normal_s=0.00012, tail_share=0.005, stall_every_s=3.0, stall_s=0.02)),
        "whole-ms": _clocks(Lateness(rounding_s=0.001)),
        "large-offset": lambda rng: {"time_offset_s": float(rng.choice([-1, 1]) * rng.uniform(0.25, 0.45))},
        "lost": _clocks(Lateness(half_normal_s=0.0001, lost_share=0.08, gap_s=0.6)),
        "drift": lambda rng: {"feature_clock": Lateness(half_normal_s=0.0001, drift_ppm=float(rng.normal(0, 150)))},
        "polled": _clocks(PC, polled_hz=50.0, robot_hz=125.0),
        "step": lambda rng: {"feature_clock": Lateness(half_normal_s=0.0001, step_s=float(rng.uniform(0.002, 0.008)))},
        "slow-robot-log": _clocks(PC, robot_hz=40.0),
    },
    "outliers": {
        "spatter-5": _set(spatter=0.05),
        "spatter-20": _set(spatter=0.20),
        "clusters-10": _set(clusters=0.10),
        "other-edge-10": _set(other_edge=0.10),
        "spatter-40": _set(spatter=0.40),
        "clusters-20": _set(clusters=0.20),
        "other-edge-20": _set(other_edge=0.20),
        "mixed": _set(spatter=0.08, clusters=0.06, other_edge=0.06),
    },
    "sensor": {
        "calibration-stated": _set(intrinsics=1.0, plane=1.0, shape=1.0),
        "calibration-unstated": _set(intrinsics=1.5, plane=1.5, shape=1.5, stated=False),
        "bent-sheet": _set(bend_mm=0.15, stated=False),
        "rounded-edge": lambda rng: {"edge_radius_mm": _log_uniform(rng, 0.15, 0.5)},
        "detector-bias": _set(bias_per_rad=1.2),
        "linearity": _set(linearity_mm=0.03, stated=False),
        "automatic-exposure": _set(exposure_wander_s=0.0005),
        "all": _set(
            intrinsics=1.0, plane=1.0, shape=1.0, bend_mm=0.08, edge_radius_mm=0.2, bias_per_rad=0.8, linearity_mm=0.01
        ),
    },
    "robot": {
        "geometry-0.2": _set(accuracy_mm=0.2),
        "geometry-0.5": _set(accuracy_mm=0.5),
        "geometry-1.0-unstated": _set(accuracy_mm=1.0, state_accuracy=False),
        "ripple": _set(ripple_arcsec=8.0, accuracy_mm=0.1),
        "hysteresis-sag": _set(hysteresis_arcsec=6.0, sag_arcsec=30.0, accuracy_mm=0.1),
        "moving-mean": lambda rng: {"mean_filter_s": float(rng.uniform(0.01, 0.04)), "accuracy_mm": 0.1},
        "commanded-poses": lambda rng: {"lag_s": float(rng.uniform(0.01, 0.04)), "accuracy_mm": 0.1},
        "all": _set(accuracy_mm=0.5, ripple_arcsec=5.0, hysteresis_arcsec=3.0, sag_arcsec=10.0, mean_filter_s=0.012),
    },
    "target": {
        "bowed": _set(bow_mm=0.3),
        "wavy": _set(wavy_mm=0.05),
        "tacks": _set(tacks_mm=0.8),
        "plane-at-stops": _set(target="plane", sensor="profiler", stops=20, noise_mm=0.02),
        "sphere-at-stops": _set(target="sphere", sensor="profiler", stops=15, noise_mm=0.02, radius_mm=30.0),
        "arc": lambda rng: {"target": "arc", "radius_mm": _log_uniform(rng, 400, 900)},
        "kinked": _set(kink_mm=0.25),
        "all": _set(bow_mm=0.15, wavy_mm=0.04, kink_mm=0.08, tacks_mm=0.5),
    },
    "everything": {f"shop-{k}": _everything for k in range(1, 9)},
}
"""Cases of each track by name."""
