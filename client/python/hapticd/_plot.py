"""Figures. Needs matplotlib."""

from __future__ import annotations

from typing import Any, Sequence

from hapticd.errors import MissingPackage


def new_figure(**options: Any) -> Any:
    """A figure that needs no screen."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingPackage("matplotlib is not installed", where="plot", remedy="apt install python3-matplotlib") from None
    return Figure(layout="constrained", **options)


def over_time(time_s: Any, columns: Sequence[tuple[str, str, Any]]) -> Any:
    """One axis for each unit, one line for each column of (name, unit, values)."""
    by_unit: dict[str, list[tuple[str, Any]]] = {}
    for name, unit, values in columns:
        by_unit.setdefault(unit, []).append((name, values))
    figure = new_figure(figsize=(8.0, 2.2 * len(by_unit) + 0.6))
    axes = figure.subplots(len(by_unit), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (unit, members) in zip(axes, by_unit.items()):
        for name, values in members:
            axis.plot(time_s, values, linewidth=1.0, label=name)
        axis.set_ylabel(unit)
        axis.grid(True, linewidth=0.3)
        axis.legend(fontsize="small", frameon=False)
    axes[-1].set_xlabel("time, s")
    return figure
