"""Line charts as SVG that a page can carry inside: no scripts, no network, colours from the page's own style."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count

import pygal
from markupsafe import Markup
from pygal.etree import etree
from pygal.style import Style

# pygal puts an importer for its map plug-ins on sys.meta_path that lacks find_spec: each later import in the whole
# process would warn, and fail where warnings are errors. We use no plug-ins.
sys.meta_path[:] = [finder for finder in sys.meta_path if type(finder).__name__ != "PluginImportFixer"]

SVG = "{http://www.w3.org/2000/svg}"

_STYLE = Style(
    background="transparent",
    plot_background="transparent",
    foreground="var(--ink-2)",
    foreground_strong="var(--ink)",
    foreground_subtle="var(--line)",
    guide_stroke_color="var(--line)",
    major_guide_stroke_color="var(--line)",
    guide_stroke_dasharray="none",
    major_guide_stroke_dasharray="none",
    colors=("var(--series-a)", "var(--series-b)", "var(--series-c)"),
    opacity="1",
    stroke_opacity="1",
    stroke_width="2.2",
    font_family="inherit",
    label_font_size=13,
    major_label_font_size=13,
    legend_font_size=13,
    no_data_font_size=16,
)


@dataclass(frozen=True)
class Curve:
    """One line: ``values`` [T], one a slot, in the order of the chart's slots."""

    label: str
    values: Sequence[float]


def line_chart(
    slots: Sequence[int], curves: Sequence[Curve], *, name: str, percent: bool = False, top: float | None = None
) -> Markup:
    """Curves over slots, as SVG text. ``name`` makes the chart's ids unique within a page."""
    chart = pygal.XY(
        style=_STYLE,
        js=[],
        width=560,
        height=270,
        margin=6,
        show_dots=False,
        show_legend=len(curves) > 1,
        legend_at_bottom=True,
        legend_at_bottom_columns=len(curves),
        legend_box_size=11,
        include_x_axis=True,
        range=None if top is None else (0.0, top),
        x_labels=slot_labels(slots[-1]) if slots else None,
        y_labels_major_count=3,
        show_minor_y_labels=True,
        no_data_text="no slot was finished",
        value_formatter=(lambda value: f"{100.0 * value:.0f}%") if percent else (lambda value: f"{value:g}"),
        x_value_formatter=lambda value: f"{value:.0f}",
        max_scale=6,
    )
    for curve in curves:
        chart.add(curve.label, list(zip(slots, curve.values, strict=True)), allow_interruptions=True)
    chart.uuid = name
    return _bare(chart.render_tree())


def slot_labels(last: int) -> list[int]:
    """Round slot numbers from 0, about six of them."""
    step = next(factor * 10**power for power in count() for factor in (1, 2, 5) if last <= 7 * factor * 10**power)
    return list(range(0, last + 1, step))


def _bare(root: etree.Element) -> Markup:
    """Without scripts, comments (which carry a date) and the hidden values that only scripts would show."""
    for parent in list(root.iter()):
        for child in list(parent):
            is_comment = not isinstance(child.tag, str)
            if is_comment or child.tag in ("script", SVG + "script", "desc", SVG + "desc"):
                parent.remove(child)
    text: str = etree.tostring(root, encoding="unicode")
    return Markup(text)  # noqa: S704 - built by the library, which escapes the labels
