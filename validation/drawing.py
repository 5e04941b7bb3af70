"""Pictures of what validations measured."""

import math
import pathlib
from collections.abc import Iterable, Sequence

import matplotlib
import numpy as np
from PIL import Image


matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402


# What is ours is filled and in strong colours; what is others' is open.
OURS = {"single": "#d62728", "shared": "#ff7f0e", "columns": "#1f77b4"}
OURS |= {"shells": "#2ca02c", "bruneton": "#e7298a"}
OTHERS = {
    "Preetham": ("#8c564b", "v"),
    "Hosek": ("#e377c2", "^"),
    "mitsuba sunsky": ("#9467bd", "D"),
    "nanodisort": ("#17becf", "s"),
    "PythonicDISORT": ("#7f7f7f", "P"),
    "sasktran2": ("#bcbd22", "X"),
}
_LEAST = 1e-5


def draw(
    path: pathlib.Path, rows: list[dict], noise: dict[str, float], notes: Sequence[str]
) -> None:
    """A panel for each class: median error over time, and what nobody beats in both.

    The whisker of a point reaches up to the error that 95 of 100 directions keep
    within. Grey is below the median standard error of the truth, `noise`.
    """
    names = list(dict.fromkeys(x["scene"] for x in rows))
    panels = len(names) + 1
    down = max(1, math.ceil(panels / 4))
    across = min(4, panels)
    figure, axes = plt.subplots(
        down, across, figsize=(4.6 * across, 4.1 * down + 0.5), squeeze=False,
        layout="constrained",
    )  # fmt: skip
    spots = list(axes.ravel())
    finite = [x for x in rows if np.isfinite(x["median_error"])]
    times = [x["time"] for x in finite]
    for name, axis in zip(names, spots, strict=False):
        here = [x for x in finite if x["scene"] == name]
        for x in here:
            _point(axis, x)
        _front(axis, here)
        axis.axhspan(1e-9, noise[name], color="0.88", zorder=0)
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_xlim(0.6 * min(times), 1.7 * max(times))
        errors = [max(x["median_error"], _LEAST) for x in here]
        tops = [x["p95_error"] for x in here]
        low = min(*errors, noise[name]) if errors else noise[name]
        axis.set_ylim(0.5 * low, min(1.6 * max(tops, default=1.0), 30.0))
        axis.yaxis.set_major_formatter(lambda y, _: f"{100.0 * y:.3g} %")
        axis.xaxis.set_major_formatter(lambda x, _: f"{x:g} s")
        axis.set_title(name)
        axis.grid(True, which="major", color="0.9", linewidth=0.6)
        axis.set_axisbelow(True)
    for axis in axes[:, 0]:
        axis.set_ylabel("relative error: median, whisker to 95 %")
    for axis in axes[-1]:
        axis.set_xlabel("time of a dome, 1024 x 512 x 41")
    _legend(spots[len(names)], rows, notes)
    for axis in spots[len(names) + 1 :]:
        axis.set_axis_off()
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _style(row: dict) -> dict:
    method = row["method"]
    if method in OURS:
        kept = row["setting"].endswith("kept")
        face = "white" if kept else OURS[method]
        return {"marker": "o", "color": OURS[method], "markerfacecolor": face}
    colour, marker = OTHERS.get(method, ("black", "*"))
    return {"marker": marker, "color": colour, "markerfacecolor": "white"}


def _short(setting: str) -> str:
    """The number that says how fine it is, or the first word."""
    words = setting.replace(",", "").split()
    if "streams" in words:
        lead = words[words.index("streams") - 1]
        return f"{lead}s" + (" quick" if "layers" in words else "")
    numbers = [x for x in words if x.replace(".", "").isdigit()]
    return numbers[0] if numbers else words[0]


def _point(axis, row: dict) -> None:
    error = max(row["median_error"], _LEAST)
    style = _style(row)
    axis.plot(
        2 * [row["time"]], [error, max(row["p95_error"], error)],
        color=style["color"], linewidth=0.8, alpha=0.55,
    )  # fmt: skip
    axis.plot(
        [row["quickest"], row["slowest"]], 2 * [error],
        color=style["color"], linewidth=1.6, alpha=0.8,
    )  # fmt: skip
    axis.plot(row["time"], error, markersize=7, linestyle="none", **style)
    axis.annotate(
        _short(row["setting"]), (row["time"], error), xytext=(5, 3),
        textcoords="offset points", fontsize=7, color=style["color"],
    )  # fmt: skip


def _front(axis, rows: Iterable[dict]) -> None:
    """Steps through what no other is both quicker and more exact than."""
    best, steps = math.inf, []
    for x in sorted(rows, key=lambda x: (x["time"], x["median_error"])):
        error = max(x["median_error"], _LEAST)
        if error < best:
            steps += [(x["time"], best if steps else 1e3), (x["time"], error)]
            best = error
    if steps:
        steps.append((1e6, best))
        axis.plot(*zip(*steps, strict=True), color="black", linewidth=0.9, zorder=1)


def _legend(axis, rows: list[dict], notes: Sequence[str]) -> None:
    axis.set_axis_off()
    handles, seen = [], set()
    for x in rows:
        kept = x["method"] in OURS and x["setting"].endswith("kept")
        name = f"{x['method']}, solved before" if kept else x["method"]
        if name not in seen:
            seen.add(name)
            (line,) = axis.plot([], [], linestyle="none", label=name, **_style(x))
            handles.append(line)
    (line,) = axis.plot([], [], color="black", label="nobody is quicker and better")
    patch = matplotlib.patches.Patch(color="0.88", label="error of the truth itself")
    axis.legend(handles=[*handles, line, patch], loc="upper left", fontsize=9)
    axis.text(
        0.0, -0.02, "\n".join(notes), transform=axis.transAxes, fontsize=7,
        verticalalignment="bottom", wrap=True,
    )  # fmt: skip


def draw_maps(path: pathlib.Path, maps: Sequence) -> None:
    """Every map of `validation.maps`, a panel for each method, on one scale."""
    panels = [(x, name, e) for x in maps for name, e in x.errors.items()]
    across = 4
    down = math.ceil(len(panels) / across)
    figure, axes = plt.subplots(
        down, across, figsize=(4.5 * across, 3.6 * down + 0.6), layout="constrained",
        squeeze=False,
    )  # fmt: skip
    edges = 10.0 ** np.arange(-6, 1)
    scale = matplotlib.colors.BoundaryNorm(edges, 256, extend="both")
    for axis, (x, name, errors) in zip(axes.ravel(), panels, strict=False):
        shown = axis.imshow(errors, norm=scale, cmap="YlOrRd", aspect="auto")
        _cells(axis, errors)
        for ticks, values in (
            (axis.set_yticks, x.rows[1]),
            (axis.set_xticks, x.columns[1]),
        ):
            ticks(range(len(values)), [f"{v:g}" for v in values], fontsize=8)
        axis.set_ylabel(x.rows[0], fontsize=9)
        axis.set_xlabel(x.columns[0], fontsize=9)
        axis.set_title(f"{name}\n", fontsize=11, weight="bold", loc="left")
        axis.text(
            0.0, 1.03, f"{x.name}, against {x.truth}", transform=axis.transAxes,
            fontsize=8, color="0.3", verticalalignment="bottom", in_layout=False,
        )  # fmt: skip
        axis.tick_params(length=0)
    for axis in axes.ravel()[len(panels) :]:
        axis.set_axis_off()
    bar = figure.colorbar(
        shown, ax=axes, location="bottom", shrink=0.5, aspect=50, ticks=edges
    )
    bar.ax.set_xticklabels([f"{100.0 * x:g} %" for x in edges])
    bar.set_label(
        "relative error of radiance that 95 of 100 directions keep within "
        "(below 0.01 % as a number); crossed out: refused"
    )
    few = {"method": Image.Quantize.MEDIANCUT, "colors": 64}
    figure.savefig(path, dpi=80, bbox_inches="tight", pad_inches=0.1)
    plt.close(figure)
    Image.open(path).convert("RGB").quantize(**few).save(path, optimize=True)


def _cells(axis, errors: np.ndarray) -> None:
    """Numbers on the cells of a map, and crosses through those without one."""
    for (i, j), value in np.ndenumerate(errors):
        if np.isnan(value):
            for lean in (-0.5, 0.5):
                axis.plot(
                    [j - 0.5, j + 0.5], [i - lean, i + lean], color="0.7", linewidth=0.8
                )
            continue
        text = f"{value:.0e}".replace("e-0", "e-")
        if value >= 1e-4:
            text = f"{float(f'{100.0 * value:.{1 if value < 0.1 else 2}g}'):g}%"
        colour = "white" if value > 0.03 else "black"
        axis.text(j, i, text, fontsize=7, ha="center", va="center", color=colour)
    axis.set_xlim(-0.5, errors.shape[1] - 0.5)
    axis.set_ylim(errors.shape[0] - 0.5, -0.5)
