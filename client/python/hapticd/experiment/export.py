"""Sessions for other programs: a folder of behavioural data by BIDS, or one table as CSV."""

from __future__ import annotations

import csv
import json
import os
import pwd
from pathlib import Path
from typing import Any, Mapping, Optional, Sequence

from hapticd.errors import BadFile
from hapticd.experiment import protocol as protocols
from hapticd.experiment.analysis import Session

#: Columns of every row, with what the sidecar says of each: meaning, and the unit or the levels.
COLUMNS: Mapping[str, Mapping[str, Any]] = {
    "onset": {
        "Description": "Begin of the presentation, or instant of the answer, since the begin of the recording of this row; without one, since "
        "the session began or went on",
        "Units": "s",
    },
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
    "level_n_per_mm": {"Description": "Stiffness of the comparison", "Units": "N/mm"},
    "granted_n_per_mm": {"Description": "Target that the daemon accepted", "Units": "N/mm"},
    "answer": {"Description": "Which felt harder", "Levels": {"first": "the first", "same": "neither", "second": "the second"}},
    "comparison_felt": {"Description": "What the answer says of the comparison", "Levels": {one: f"the comparison felt {one}" for one in ("harder", "same", "softer")}},
    "similarity": {"Description": "Rating of the pair, 0 … 100"},
    "peak_force_n": {"Description": "Greatest force of the real object; none is measured of a virtual one", "Units": "N"},
    "peak_displacement_mm": {"Description": "Greatest displacement", "Units": "mm"},
    "peak_press_speed_mm_per_s": {"Description": "Greatest speed into the object", "Units": "mm/s"},
    "flaws": {"Description": "Why it did not count, separated by commas"},
    "begin_tick": {"Description": "First tick of the presentation in the recording"},
    "end_tick": {"Description": "Last tick of the presentation in the recording"},
    "recording": {"Description": "Name of the daemon's recording with the telemetry of these ticks"},
}
#: Columns of participants.tsv.
PEOPLE: Mapping[str, Mapping[str, Any]] = {
    "number": {"Description": "Number of the participant, from 0; the order of the conditions depends on it"},
    "seed": {"Description": "Seed of all that was drawn at random"},
    "finished": {"Description": "Whether all trials were answered", "Levels": {"0": "no", "1": "yes"}},
}
MISSING = "n/a"

#: Names as PsychoPy has them, for programs that read those.
PSYCHOPY = {
    "participant": "participant", "condition": "condition", "trials.thisN": "trial", "trials.intensity": "level_n_per_mm",
    "key_resp.keys": "answer", "comparison_felt": "comparison_felt", "training": "training", "attempt": "attempt",
    "similarity": "similarity", "onset": "onset", "expName": "task",
}  # fmt: skip

Row = dict[str, Any]


def rows(one: Session) -> list[Row]:
    """An event of the journal each: presentations, answers, discarded trials."""
    found: list[Row] = []
    begin_s: Optional[float] = None
    recording: Optional[str] = None
    last_s = 0.0
    for event in one.events:
        time_s = event.get("time_s")
        if time_s is not None:
            if event["event"] == "recording" or begin_s is None or time_s < last_s:  # the rig's clock began again
                begin_s, recording = time_s, event.get("recording")
            last_s = time_s
        if event["event"] not in ("presentation", "answer", "discarded"):
            continue
        duration, pressed_mm = event.get("duration_s"), event.get("peak_displacement_mm") or 0.0
        found.append(
            {
                "onset": None if time_s is None or begin_s is None else round(max(time_s - begin_s - (duration or 0.0), 0.0), 4),
                "duration": duration,
                "trial_type": event["event"],
                "condition": event["condition"],
                "training": int(event["training"]),
                "trial": event["trial"],
                "attempt": event["attempt"],
                "interval": event.get("interval"),
                "stimulus": event.get("role"),
                "level_n_per_mm": event["level_n_per_mm"],
                "granted_n_per_mm": event.get("granted_n_per_mm"),
                "answer": event.get("answer"),
                "comparison_felt": event.get("comparison_felt"),
                "similarity": event.get("similarity"),
                "peak_force_n": event.get("peak_force_n") or (None if pressed_mm > 0.0 else event.get("peak_force_n")),
                "peak_displacement_mm": event.get("peak_displacement_mm"),
                "peak_press_speed_mm_per_s": event.get("peak_press_speed_mm_per_s"),
                "flaws": ",".join(event.get("flaws") or event.get("why") or ()) or None,
                "begin_tick": event.get("begin_tick"),
                "end_tick": event.get("end_tick"),
                "recording": event.get("recording") or recording,
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


def _json(path: Path, value: Any) -> None:
    _write(path, json.dumps(value, indent=2, ensure_ascii=False) + "\n")


def _present(names: Sequence[str], lines: Sequence[Row]) -> list[str]:
    """Columns without those that no row has, such as times if there was no rig."""
    return [name for name in names if any(line.get(name) is not None for line in lines)]


def to_bids(sessions: Sequence[Session], folder: Path, authors: Sequence[str] = ()) -> list[Path]:
    """BIDS, behavioural data: sub-CODE/beh/sub-CODE_task-NAME_beh.tsv with a sidecar, participants and a description. Raises
    BadFile if the folder has files already, or if two codes are the same without '_' and '-'."""
    if folder.exists() and any(folder.iterdir()):
        raise BadFile("the folder is not empty", where=str(folder), remedy="name a new one")
    labels = [_plain(one.participant) for one in sessions]
    for one, label in zip(sessions, labels):
        if not label or labels.count(label) > 1:
            raise BadFile("participants' codes must differ in letters and digits", where=str(one.path), value=repr(one.participant))
    protocol = sessions[0].protocol
    task = _plain(protocol.name)
    names = _present(list(COLUMNS), [row for one in sessions for row in rows(one)])  # the same in all tables
    about = {"TaskName": protocol.name, "TaskDescription": protocol.title, "Instructions": protocol.question}
    written = []
    for one, label in zip(sessions, labels):
        table = folder / f"sub-{label}" / "beh" / f"sub-{label}_task-{task}_beh.tsv"
        _write(table, _table(names, rows(one)))
        _json(table.with_suffix(".json"), {**about, **{name: COLUMNS[name] for name in names}})
        written += [table, table.with_suffix(".json")]
    people = [
        {"participant_id": f"sub-{label}", "number": one.state.number, "seed": one.state.seed, "finished": int(one.state.ended)}
        for one, label in zip(sessions, labels)
    ]
    _write(folder / "participants.tsv", _table(["participant_id", *PEOPLE], people))
    _json(folder / "participants.json", PEOPLE)
    about_set = {
        "Name": protocol.title, "BIDSVersion": "1.8.0", "DatasetType": "raw", "Authors": list(authors) or [_own_name()],
        "GeneratedBy": [{"Name": "hapticd", "Description": "hapticctl experiment export"}],
    }  # fmt: skip
    _json(folder / "dataset_description.json", about_set)
    _write(folder / "README", _readme(protocol, len(sessions)))
    more = ("participants.tsv", "participants.json", "dataset_description.json", "README")
    return [*written, *(folder / name for name in more)]


def _own_name() -> str:
    """Name of the user who exports."""
    try:
        user = pwd.getpwuid(os.getuid())
    except KeyError:  # a container may have no such user
        return f"user {os.getuid()}"
    return user.pw_gecos.split(",")[0] or user.pw_name


def _readme(protocol: protocols.Protocol, participants: int) -> str:
    source = f" ({protocol.source})" if protocol.source else ""
    conditions = ", ".join(one.name for one in protocol.conditions)
    return f"""# {protocol.title}

A perception experiment{source} with {participants} participants, on a haptic device that changes the stiffness of what is touched.
The participants were asked: "{protocol.question}". The conditions are {conditions}.

Each participant has one table of behavioural data. A row is a presentation of a stimulus, an answer, or a trial that was discarded and
presented again; the file next to it says what each column means, with its unit. The tables were made from the journals of hapticctl
experiment. Where the daemon recorded the session, a row names the recording, and its first and last tick there.
"""


def _with_unit(name: str) -> str:
    """A time has its plain name in BIDS only, where the file next to the table says that it is in s."""
    return f"{name}_s" if COLUMNS.get(name, {}).get("Units") == "s" else name


def to_csv(sessions: Sequence[Session], path: Path, *, psychopy: bool = False) -> None:
    """One table of all participants. `psychopy`: answers only, under the names that PsychoPy gives."""
    if path.exists():
        raise BadFile("the file is there already", where=str(path), remedy="name another")
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        names = list(PSYCHOPY) if psychopy else ["participant", *COLUMNS]
        writer.writerow(names if psychopy else [_with_unit(name) for name in names])
        for one in sessions:
            for row in rows(one):
                if psychopy and row["trial_type"] != "answer":
                    continue
                full = {**row, "participant": one.participant, "task": one.protocol.name}
                writer.writerow(["" if (value := full.get(PSYCHOPY[name] if psychopy else name)) is None else value for name in names])
