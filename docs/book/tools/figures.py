"""All figures of the book, each from what the program gives now."""

import charts
import growing
import reference
import scenes
import theory
from scan import Scene, simulated


def generate(program, scratch) -> dict[str, str]:
    """All figures by the name of their file."""
    folder = scratch / "figures"
    folder.mkdir()
    good = simulated(program, folder / "good", "--preset", "good")
    scene = Scene(good)
    return {
        "motion.svg": scenes.film(scene),
        "frames.svg": scenes.frames(scene),
        "observability.svg": charts.observability(program, folder),
        "straightness.svg": charts.straightness(program, folder),
        "collapse.svg": charts.collapse(program, folder),
        "stamps.svg": charts.stamps(program, folder),
        "before-after.svg": charts.before_after(program, folder),
        "convergence.svg": charts.convergence(program, folder),
        "budget.svg": charts.budget(program, folder),
        "growing.svg": growing.film(program, folder, good),
        "blocks.svg": theory.blocks(program, folder),
        "honest.svg": theory.honest(program, folder),
        "stripe.svg": theory.stripe(program, folder),
        "presets.svg": charts.presets(program, folder, [name for name, _ in reference.preset_names(program)]),
    }
