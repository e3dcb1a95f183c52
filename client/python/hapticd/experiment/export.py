"""Sessions for other programs: a folder of behavioural data by BIDS, or one table as CSV."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any, Mapping, Sequence

from hapticd.errors import BadFile
from hapticd.experiment.analysis import Session

#: Of every row, with what the sidecar says of it: meaning, and the unit or the levels.
COLUMNS: Mapping[str, Mapping[str, Any]] = {
    "onset": {"Description": "Begin of the presentation, or instant of the answer, by the rig's clock", "Units": "s"},
    "duration": {"Description": "Length of the presentation", "Units": "s"},
    "trial_type": {
        "Description": "What the row is about",
        "Levels": {"presentation": "a stimulus", "answer": "the participant's answer", "discarded": "the trial is repeated"},
    },
    "condition": {"Description": "Name of the condition in the protocol"},
    "training": {"Description": "1: not part of the result"},
    "trial": {"Description": "Answered trials of the condition before this one"},
    "attempt": {"Description": "Discarded attempts at this trial before this one"},
    "interval": {"Description": "1: the first of the pair, 2: the second"},
    "stimulus": {"Description": "Which of the two", "Levels": {"reference": "the reference", "comparison": "what varies"}},
    "level": {"Description": "Stiffness of the comparison", "Units": "N/mm"},
    "granted": {"Description": "Target that the daemon accepted", "Units": "N/mm"},
    "answer": {"Description": "Which felt harder", "Levels": {"first": "the first", "same": "neither", "second": "the second"}},
    "comparison_felt": {"Description": "What the answer says of the comparison", "Levels": {"harder": "", "same": "", "softer": ""}},
    "similarity": {"Description": "Rating of the pair, 0 … 100"},
    "peak_force": {"Description": "Greatest reaction force", "Units": "N"},
    "peak_displacement": {"Description": "Greatest displacement", "Units": "mm"},
    "peak_press_speed": {"Description": "Greatest speed into the object", "Units": "mm/s"},
    "flaws": {"Description": "Why it did not count, separated by commas"},
    "begin_tick": {"Description": "First tick of the presentation in the recording"},
    "end_tick": {"Description": "Last tick of the presentation in the recording"},
    "recording": {"Description": "Name of the daemon's recording with the telemetry of these ticks"},
}
MISSING = "n/a"

#: Names as PsychoPy has them, for programs that read those.
PSYCHOPY = {
    "participant": "participant", "condition": "condition", "trials.thisN": "trial", "trials.intensity": "level",
    "key_resp.keys": "answer", "comparison_felt": "comparison_felt", "training": "training", "attempt": "attempt",
    "similarity": "similarity", "onset": "onset", "expName": "task",
}  # fmt: skip

Row = dict[str, Any]


def rows(one: Session) -> list[Row]:
    """An event of the journal each: presentations, answers, discarded trials."""
    found: list[Row] = []
    for event in one.events:
        if event["event"] not in ("presentation", "answer", "discarded"):
            continue
        duration, end = event.get("duration_s"), event.get("time_s")
        found.append(
            {
                "onset": end if duration is None or end is None else round(end - duration, 4),
                "duration": duration,
                "trial_type": event["event"],
                "condition": event["condition"],
                "training": int(event["training"]),
                "trial": event["trial"],
                "attempt": event["attempt"],
                "interval": event.get("interval"),
                "stimulus": event.get("role"),
                "level": event["level_n_per_mm"],
                "granted": event.get("granted_n_per_mm"),
                "answer": event.get("answer"),
                "comparison_felt": event.get("comparison_felt"),
                "similarity": event.get("similarity"),
                "peak_force": event.get("peak_force_n"),
                "peak_displacement": event.get("peak_displacement_mm"),
                "peak_press_speed": event.get("peak_press_speed_mm_per_s"),
                "flaws": ",".join(event.get("flaws") or event.get("why") or ()) or None,
                "begin_tick": event.get("begin_tick"),
                "end_tick": event.get("end_tick"),
                "recording": event.get("recording"),
            }
        )
    return found


def _plain(name: str) -> str:
    """Labels of BIDS have letters and digits only."""
    return "".join(letter for letter in name if letter.isalnum())


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, "utf-8")


def _table(names: Sequence[str], lines: Sequence[Mapping[str, Any]]) -> str:
    def cell(value: Any) -> str:
        return MISSING if value is None else str(value).replace("\t", " ").replace("\n", " ")

    return "\n".join(["\t".join(names), *("\t".join(cell(line.get(name)) for name in names) for line in lines)]) + "\n"


def to_bids(sessions: Sequence[Session], folder: Path) -> list[Path]:
    """BIDS, behavioural data: sub-CODE/beh/sub-CODE_task-NAME_events.tsv with a sidecar, participants.tsv and a description. Raises
    BadFile where the folder has files already, or where two codes are the same without '_' and '-'."""
    if folder.exists() and any(folder.iterdir()):
        raise BadFile("the folder is not empty", where=str(folder), remedy="name a new one")
    labels = [_plain(one.participant) for one in sessions]
    for one, label in zip(sessions, labels):
        if not label or labels.count(label) > 1:
            raise BadFile("participants' codes must differ in letters and digits", where=str(one.path), value=repr(one.participant))
    protocol = sessions[0].protocol
    task = _plain(protocol.name)
    written = []
    for one, label in zip(sessions, labels):
        stem = folder / f"sub-{label}" / "beh" / f"sub-{label}_task-{task}"
        table, sidecar = stem.with_name(stem.name + "_events.tsv"), stem.with_name(stem.name + "_events.json")
        _write(table, _table(list(COLUMNS), rows(one)))
        description: dict[str, Any] = {"TaskName": task, "TaskDescription": protocol.title, "Instructions": protocol.question, **COLUMNS}
        _write(sidecar, json.dumps(description, indent=2, ensure_ascii=False) + "\n")
        written += [table, sidecar]
    people = [
        {"participant_id": f"sub-{label}", "number": one.state.number, "seed": one.state.seed, "finished": int(one.state.ended)}
        for one, label in zip(sessions, labels)
    ]
    _write(folder / "participants.tsv", _table(["participant_id", "number", "seed", "finished"], people))
    _write(
        folder / "dataset_description.json",
        json.dumps(
            {
                "Name": protocol.title, "BIDSVersion": "1.8.0", "DatasetType": "raw",
                "GeneratedBy": [{"Name": "hapticd", "Description": protocol.source}],
            },
            indent=2, ensure_ascii=False,
        ) + "\n",
    )  # fmt: skip
    _write(folder / "README", f"{protocol.title}. {protocol.source}.\nMade from the journals of hapticctl experiment.\n")
    return [*written, folder / "participants.tsv", folder / "dataset_description.json", folder / "README"]


def to_csv(sessions: Sequence[Session], path: Path, *, psychopy: bool = False) -> None:
    """One table of all participants. `psychopy`: answers only, under the names that PsychoPy gives."""
    if path.exists():
        raise BadFile("the file is there already", where=str(path), remedy="name another")
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        names = list(PSYCHOPY) if psychopy else ["participant", *COLUMNS]
        writer.writerow(names)
        for one in sessions:
            for row in rows(one):
                if psychopy and row["trial_type"] != "answer":
                    continue
                full = {**row, "participant": one.participant, "task": one.protocol.name}
                writer.writerow(["" if (value := full.get(PSYCHOPY[name] if psychopy else name)) is None else value for name in names])
