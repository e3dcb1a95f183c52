"""Telemetry as a table of numbers."""

from __future__ import annotations

from typing import Any, Iterable, Sequence

import numpy as np
import numpy.typing as npt

from hapticd import _plot
from hapticd.errors import BadArgument, MissingPackage
from hapticd.v1 import telemetry_pb2

#: Plotted if nothing is chosen.
_USUAL = (
    "contact_reaction_force_n",
    "control_hand_force_n",
    "deformation_displacement_mm",
    "target_target_stiffness_n_per_mm",
)


class Columns:
    """Names, units and types of a table's columns, as a stream or a recording announces them once."""

    def __init__(self, names: Sequence[str], units: Sequence[str], types: Sequence[str]) -> None:
        self.names = list(names)
        self.units = dict(zip(names, units))
        self.dtype = np.dtype({"names": self.names, "formats": list(types)}) if names else np.dtype([])

    @staticmethod
    def of(columns: Iterable[telemetry_pb2.TelemetryColumn]) -> Columns:
        described = list(columns)
        return Columns(
            [one.name for one in described],
            [one.unit for one in described],
            ["<i8" if one.type == telemetry_pb2.COLUMN_TYPE_INT64 else "<f8" for one in described],
        )


class Block:
    """Samples as columns: `block["control_hand_force_n"]` is an array, one value for each sample.

    NaN: the group does not exist in the loaded scene. Booleans are 0 or 1, enumerations their number, bit sets their sum.
    """

    def __init__(self, columns: Columns, rows: npt.NDArray[Any], lost: int = 0) -> None:
        self.columns = columns
        #: All of it, one row for each sample.
        self.rows = rows
        #: Samples that are missing: they were lost between daemon and client.
        self.lost = lost

    @property
    def names(self) -> list[str]:
        return self.columns.names

    def unit(self, name: str) -> str:
        """E.g. "N/mm"; "1" if it has none."""
        self._check(name)
        return self.columns.units[name]

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        self._check(name)
        column: npt.NDArray[Any] = self.rows[name]
        return column

    def __contains__(self, name: object) -> bool:
        return name in self.columns.units

    def __len__(self) -> int:
        return len(self.rows)

    def vector(self, name: str) -> npt.NDArray[np.float64]:
        """N×3 of the columns of a vector: "truth_tip_position_mm" of …_x_mm, …_y_mm and …_z_mm."""
        parts = _parts(self.names, name)
        if len(parts) != 3:
            vectors = sorted({other.replace("_x_", "_", 1) for other in self.names if "_x_" in other})
            raise BadArgument("there is no such vector", where="Block.vector", value=repr(name), limit=", ".join(vectors))
        return np.stack([self.rows[part] for part in parts], axis=1)

    @property
    def ticks(self) -> npt.NDArray[np.int64]:
        return self["tick"]

    @property
    def time_s(self) -> npt.NDArray[np.float64]:
        """Time by the rig's clock, from the daemon's start."""
        if "time_ns" in self:
            return np.asarray(self["time_ns"], dtype=np.float64) * 1e-9
        return np.asarray(self["time_s"], dtype=np.float64)

    def between(self, first_tick: int, last_tick: int) -> Block:
        """The samples of these ticks, both included."""
        chosen = (self.ticks >= first_tick) & (self.ticks <= last_tick)
        return Block(self.columns, self.rows[chosen], self.lost)

    def to_pandas(self) -> Any:
        """A DataFrame, the ticks as its index; attrs["units"] has the units. Needs pandas."""
        try:
            import pandas
        except ImportError:
            raise MissingPackage("pandas is not installed", where="Block.to_pandas", remedy="apt install python3-pandas") from None
        frame = pandas.DataFrame(self.rows)
        if "tick" in self:
            frame = frame.set_index("tick")
        frame.attrs["units"] = dict(self.columns.units)
        return frame

    def plot(self, *names: str) -> Any:
        """A figure, one axis for each unit; without names: force, displacement and target. Needs matplotlib."""
        chosen = list(names) or [name for name in _USUAL if name in self]
        if not chosen:
            raise BadArgument("none of the usual columns is here", where="Block.plot", limit=", ".join(self.names))
        time_s = self.time_s - (self.time_s[0] if len(self) else 0.0)
        return _plot.over_time(time_s, [(name, self.unit(name), self[name]) for name in chosen])

    def _check(self, name: str) -> None:
        if name not in self.columns.units:
            near = [other for other in self.names if name.split("_")[0] in other] or self.names
            raise BadArgument("there is no such column", where="Block", value=repr(name), limit=", ".join(near))

    @staticmethod
    def joined(blocks: Sequence[Block]) -> Block:
        """One after the other; all have the same columns. At least one."""
        rows = np.concatenate([block.rows for block in blocks])
        return Block(blocks[0].columns, rows, sum(block.lost for block in blocks))


def _parts(names: Sequence[str], vector: str) -> list[str]:
    """The columns whose name without _x, _y or _z is that of the vector."""
    found: dict[str, str] = {}
    for name in names:
        for axis in "xyz":
            if f"_{axis}_" in name or name.endswith(f"_{axis}"):
                whole = name.replace(f"_{axis}_", "_", 1) if f"_{axis}_" in name else name[: -len(axis) - 1]
                if whole == vector:
                    found[axis] = name
    return [found[axis] for axis in "xyz" if axis in found]
