"""What networks learned, drawn: learning curves, and relation weights as in Fig. 2."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from policy.evaluation.tables.campuses import Campus
from policy.evaluation.tables.grid import BASE_MCL_DB, BASE_UAVS
from policy.evaluation.tables.methods import Model
from policy.evaluation.tables.plots import COLOURS, blank

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PANELS = {
    "score": "episodic AoI of the episode (slots)",
    "value_loss": "value loss L_val",
    "prediction_loss": "prediction loss L_pred",
}
WIDEST = 3.5
"""Points, of the line with the greatest weight in the picture."""


def learning_curves(models: Sequence[Model]) -> "Figure | None":
    """Score and losses by episode, one colour a network; None where no network's curve was kept."""
    kept = [(model, model.curve) for model in models if model.curve]
    if not kept:
        return None
    figure, panels = blank((12.0, 3.8), 1, len(PANELS))
    for number, (model, curve) in enumerate(kept):
        colour = COLOURS[number % len(COLOURS)]
        episodes = [point.episode for point in curve]
        for panel, name in zip(panels, PANELS, strict=True):
            values = [getattr(point, name) for point in curve]
            if name == "score":  # an episode's score is mostly its place's, so the mean is the line
                panel.plot(episodes, values, ".", color=colour, markersize=2.0, alpha=0.35)
                values = [point.mean_score for point in curve]
            panel.plot(episodes, values, color=colour, linewidth=1.2, label=f"{model.name} ({model.kind})")
    for panel, label in zip(panels, PANELS.values(), strict=True):
        panel.set(xlabel="episode", ylabel=label)
        panel.grid(alpha=0.3)
        panel.set_yscale("log")
    panels[-1].legend()
    return figure


def relation_lines(campus: Campus, told: Mapping[str, Any]) -> "Figure":
    """UAVs, users and a line between each two, as thick as its weight; users are the darker the older their data."""
    figure, (panel,) = blank((6.4, 5.2), 1, 1)
    scenario, _ = campus.opened(BASE_UAVS, BASE_MCL_DB)
    uavs_m, users_m, weights = (np.asarray(told[name]) for name in ("uav_pos_m", "user_pos_m", "weights"))
    greatest = max(float(weights.max()), 1e-9)
    for obstacle in scenario.blocking_obstacles:
        panel.fill(*np.asarray(obstacle.polygon_m).T, color="#dddddd")
    for uav, (place_m, row) in enumerate(zip(uavs_m, weights, strict=True)):
        colour = COLOURS[uav % len(COLOURS)]
        for user_m, weight in zip(users_m, row, strict=True):
            width: Any = {"linewidth": WIDEST * weight / greatest, "alpha": 0.6, "color": colour, "zorder": 1}
            panel.plot(*np.stack([place_m, user_m]).T, **width)
        label = f"UAV {uav + 1}: {row.sum():.2f} to users, at most {row.max():.3f} to one"
        panel.plot(*place_m, "^", color=colour, markersize=11.0, markeredgecolor="black", zorder=3, label=label)
    style: Any = {"c": told["user_aoi_slots"], "cmap": "Greys", "vmin": 0.0, "edgecolors": "black", "s": 26.0}
    dots = panel.scatter(*users_m.T, linewidths=0.5, zorder=2, **style)
    figure.colorbar(dots, ax=panel, label="user's AoI (slots)", shrink=0.8)
    east_m, north_m = scenario.area.size_m
    panel.set(xlim=(0.0, east_m), ylim=(0.0, north_m), aspect="equal", xlabel="east (m)", ylabel="north (m)")
    panel.set_title(f"{campus.name}, slot {told['slot']}: relation weights of gcrl ({told['network']})")
    panel.legend(loc="lower center", bbox_to_anchor=(0.5, 1.06))
    return figure
