"""Figures of blocks. Needs matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Sequence

from hapticd.errors import BadArgument, MissingPackage

if TYPE_CHECKING:
    from hapticd.block import Block

#: Shown where nothing is chosen.
USUAL = (
    "contact_reaction_force_n",
    "control_hand_force_n",
    "deformation_displacement_mm",
    "target_target_stiffness_n_per_mm",
)


def new_figure(**options: Any) -> Any:
    """A figure that needs no screen."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingPackage("matplotlib is not installed", where="plot", remedy="apt install python3-matplotlib") from None
    return Figure(layout="constrained", **options)


def columns_over_time(block: Block, names: Sequence[str]) -> Any:
    """One axis for each unit, one line for each column."""
    chosen = list(names) or [name for name in USUAL if name in block]
    if not chosen:
        raise BadArgument("none of the usual columns is here", where="Block.plot", limit=", ".join(block.names))
    by_unit: dict[str, list[str]] = {}
    for name in chosen:
        by_unit.setdefault(block.unit(name), []).append(name)
    figure = new_figure(figsize=(8.0, 2.2 * len(by_unit) + 0.6))
    axes = figure.subplots(len(by_unit), 1, sharex=True, squeeze=False)[:, 0]
    time_s = block.time_s - (block.time_s[0] if len(block) else 0.0)
    for axis, (unit, members) in zip(axes, by_unit.items()):
        for name in members:
            axis.plot(time_s, block[name], linewidth=1.0, label=name)
        axis.set_ylabel(unit)
        axis.grid(True, linewidth=0.3)
        axis.legend(fontsize="small", frameon=False)
    axes[-1].set_xlabel("time, s")
    return figure
