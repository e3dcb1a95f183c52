"""hapticctl experiment, or python3 -m hapticd.experiment: experiments from the command line."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import shlex
import sys
from pathlib import Path
from typing import Any, Callable, Optional, Sequence

import hapticd
from hapticd._shown import printable, say
from hapticd.errors import BadArgument, BadFile, HapticdError, Refused, Unreachable
from hapticd.experiment import analysis, ending, export, plots, readiness, runner, session, simulated, simulation
from hapticd.experiment import protocol as protocols
from hapticd.experiment.hands import Hand, Person, PersonOnSimulatedRig
from hapticd.experiment.journal import Journal
from hapticd.experiment.rig_stage import RigStage
from hapticd.experiment.scan import surface_toml, touches_of
from hapticd.v1 import rig_pb2

DONE, REFUSED, USAGE, UNREACHABLE, NOT_FINISHED = 0, 1, 2, 3, 5
EXIT_CODES = "exit codes: 0 done; 1 refused, or a file is not what it should be; 2 wrong usage; 3 no daemon; 5 the session was ended early"


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Exit code."""
    options = _parser().parse_args(arguments)
    try:
        with ending.by_signals():
            return int(options.do(options))
    except HapticdError as error:
        _say_error(error, options)
        return UNREACHABLE if isinstance(error, Unreachable) else REFUSED
    except OSError as error:
        _say_error(HapticdError(error.strerror or str(error), where=str(error.filename or "")), options)
        return REFUSED
    except KeyboardInterrupt:
        with contextlib.suppress(OSError):  # the terminal may be gone
            journal: Optional[Path] = getattr(options, "journal", None)  # of run, once it is known which
            goes_on = f"; {_resuming(journal)} goes on with it" if journal and journal.exists() else ""
            say(f"ended{goes_on}", sys.stderr)
        return NOT_FINISHED


def _resuming(journal: Path) -> str:
    return f"hapticctl experiment resume {shlex.quote(str(journal))}"


def _say(options: argparse.Namespace, text: str, **values: Any) -> None:
    """The text for people, or the values for programs."""
    say(json.dumps(values, ensure_ascii=False) if options.json else text)


def _of_error(error: HapticdError) -> dict[str, str]:
    kind = "unreachable" if isinstance(error, Unreachable) else "refused" if isinstance(error, Refused) else "error"
    names = ("code", "reason", "what", "where", "value", "limit", "remedy")
    return {"kind": kind, **{name: str(getattr(error, name)) for name in names}, "reason": error.reason.lower()}


def _say_error(error: HapticdError, options: argparse.Namespace) -> None:
    if options.json:
        say(json.dumps({"error": _of_error(error)}, ensure_ascii=False))
    else:
        say(f"hapticctl: {printable(str(error))}", sys.stderr)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="hapticctl experiment", description="Perception experiments.", epilog=EXIT_CODES)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def command(name: str, do: Any, about: str) -> argparse.ArgumentParser:
        one: argparse.ArgumentParser = commands.add_parser(name, help=about, description=about + ".", epilog=EXIT_CODES)
        one.set_defaults(do=do)
        one.add_argument("--json", action="store_true", default=bool(os.environ.get("HAPTICD_JSON")), help="for programs instead of text for people")
        return one

    shipped = ", ".join(sorted(one.stem for one in protocols.SHIPPED.glob("*.toml")))

    def protocol_of(one: argparse.ArgumentParser) -> None:
        one.add_argument("protocol", help=f"a TOML file, or one of {shipped}")

    def folder_of(one: argparse.ArgumentParser) -> None:
        one.add_argument("--folder", type=Path, default=Path("sessions"), help="of the journals; sessions if not given")

    def page_of(one: argparse.ArgumentParser) -> None:
        one.add_argument("--port", type=int, default=8765, help="of the pages, on this machine only; 0: a free one; 8765 if not given")
        one.add_argument("--no-record", action="store_true", help="the daemon does not record the session")

    check = command("check", _check, "What a protocol asks for, and whether the rig can do it")
    protocol_of(check)
    check.add_argument("--no-rig", action="store_true", help="the file alone")
    check.add_argument("--write-rig", type=Path, metavar="FILE", help="a new file: the configuration of a simulated rig with the stations of a shipped protocol")

    run = command("run", _run, "A participant's session, at a page in the browser")
    protocol_of(run)
    folder_of(run)
    run.add_argument("--participant", required=True, help="a code of letters, digits, '_' and '-', used once")
    run.add_argument("--number", type=int, help="from 0, for the order of conditions; how many were before if not given")
    run.add_argument("--seed", type=int, default=1, help="of all that is drawn; the same for all participants")
    page_of(run)

    resume = command("resume", _resume, "Goes on with a session that was ended or died")
    resume.add_argument("journal", type=Path, help="FOLDER/PROTOCOL_PARTICIPANT.jsonl")
    resume.add_argument("--protocol", help="to make sure that it is this one")
    page_of(resume)

    simulate = command("simulate", _simulate, "Simulated participants; those that were not finished go on")
    protocol_of(simulate)
    folder_of(simulate)
    simulate.add_argument("--participants", type=int, help="how many; the protocol says it if not given")
    simulate.add_argument("--only", type=int, metavar="NUMBER", help="of them this one, from 0: others may run at the same time on other rigs")
    simulate.add_argument("--seed", type=int, default=1, help="of the observers and of all that is drawn")
    simulate.add_argument("--no-rig", action="store_true", help="what is felt is the level; for a first look at a protocol")
    simulate.add_argument("--every-trial", action="store_true", help="each trial on the rig, which takes hours; else each stimulus is felt a few times")
    simulate.add_argument("--record", action="store_true", help="have the daemon record the sessions")

    scan = command("scan", _scan, "From a recording of touches to the section [wall.surface] of a scene")
    scan.add_argument("recording", help="MCAP or HDF5, with light touches all over the object")
    scan.add_argument("--step", type=float, default=5.0, help="of the grid, mm; 5 if not given")
    scan.add_argument("--out", type=Path, required=True, help="a new file")

    analyse = command("analyse", _analyse, "Estimates and figures of sessions")
    analyse.add_argument("journals", type=Path, nargs="+", help="journals, or folders of them")
    analyse.add_argument("--figures", type=Path, help="a folder for figures (SVG); needs python3-matplotlib")
    analyse.add_argument("--bootstrap", type=int, default=0, metavar="N", help="intervals by N resamples, for constant stimuli")

    exported = command("export", _export, "Sessions as BIDS or CSV")
    exported.add_argument("journals", type=Path, nargs="+", help="journals, or folders of them")
    exported.add_argument("--out", type=Path, required=True, help="a new folder (BIDS), or a new file NAME.csv")
    exported.add_argument("--author", action="append", default=[], metavar="NAME", help="of the BIDS data set, may be repeated; your own name if not given")
    exported.add_argument("--psychopy", action="store_true", help="answers only, under PsychoPy's names; CSV")
    return parser


def _check(options: argparse.Namespace) -> int:
    protocol = protocols.read(options.protocol)
    if options.write_rig is not None:
        with options.write_rig.open("x", encoding="utf-8") as file:
            file.write(protocols.simulated_rig(protocol.name).read_text("utf-8"))
        _say(options, f"{options.write_rig}: a simulated rig with a turntable; hapticd --config {options.write_rig}", rig=str(options.write_rig))
        return DONE
    conditions = [
        {
            "name": one.name, "reference": analysis.stimulus_name(one.reference), "comparison": analysis.stimulus_name(one.comparison),
            "reference_n_per_mm": one.reference_n_per_mm,
        }
        for one in protocol.conditions
    ]  # fmt: skip
    found, remark = ([], "") if options.no_rig else _looked_at(protocol)
    if options.json:
        values = {"protocol": protocol.name, "sha256": protocol.sha256, "participants": protocol.participants, "conditions": conditions}
        say(json.dumps({**values, "problems": [_of_error(one) for one in found], "remark": remark}, indent=2, ensure_ascii=False))
        return REFUSED if found else DONE
    source = f" ({protocol.source})" if protocol.source else ""
    say(f"{protocol.title}{source}, {protocol.participants} participants, sha256 {protocol.sha256[:12]}")
    for one in conditions:
        target = f", target {one['reference_n_per_mm']:g} N/mm" if protocol.kind == "compare" else ""
        say(f"  {one['name']}: {one['reference']} against {one['comparison']}{target}")
    if remark:
        say(f"remark: {remark}")
    for problem in found:
        _say_error(problem, options)
    if not found and not options.no_rig:
        say("this rig can do all of it")
    return REFUSED if found else DONE


def _looked_at(protocol: protocols.Protocol) -> tuple[list[HapticdError], str]:
    """What a rig lacks now, and what is worth knowing."""
    with hapticd.connect() as rig, RigStage(rig, Person(lambda: True)) as stage:
        try:
            stage.check(protocol)
        except BadFile as error:
            return [error], ""
        found = readiness.problems(rig, protocol)
        if (problem := readiness.latched_problem(rig)) is not None:
            found.insert(0, problem)
        remarks = [readiness.too_fast(rig)]
        try:
            rig.list_recordings()
        except Refused as refused:
            remarks.append(f"{refused.what}; run needs --no-record, or [recording] folder in the daemon's configuration")
        return found, "; ".join(filter(None, remarks))


def _recording_name(rig: hapticd.Rig, options: argparse.Namespace, name: str) -> str:
    """Empty: none is made."""
    if options.no_record:
        return ""
    try:
        rig.list_recordings()
    except Refused as error:
        raise BadArgument(
            f"the daemon keeps no recordings: {error.what}", where="--no-record", value="not given",
            remedy="name a folder in [recording] of its configuration, or give --no-record",
        ) from error  # fmt: skip
    return name


def _require_ready(rig: hapticd.Rig, protocol: protocols.Protocol) -> None:
    if found := readiness.problems(rig, protocol):
        raise found[0]


def _run(options: argparse.Namespace) -> int:
    protocol = protocols.read(options.protocol)
    number = runner.numbers_used(options.folder, protocol) if options.number is None else options.number
    path = options.journal = runner.path_of(options.folder, protocol, options.participant)
    with hapticd.connect() as rig:

        def begin(stage: RigStage) -> Journal:
            stage.check(protocol)
            _require_ready(rig, protocol)  # before there is a journal
            return runner.begin(options.folder, protocol, options.participant, number, options.seed, simulation.versions_of(rig), stage.rendered)

        return _session(rig, path, options.seed, begin, options)


def _resume(options: argparse.Namespace) -> int:
    wanted = protocols.read(options.protocol) if options.protocol else None
    journal = runner.resume(options.journal, wanted)  # no other program writes it: the one that did has ended
    with hapticd.connect() as rig:
        return _session(rig, journal.path, session.fold(journal.events).seed, lambda stage: journal, options)


def _session(rig: hapticd.Rig, path: Path, seed: int, begin: Callable[[RigStage], Journal], options: argparse.Namespace) -> int:
    """A person's session. begin: its journal, once the rig is under control."""
    from hapticd.experiment.page_server import PageServer
    from hapticd.experiment.reporting import Reporter

    with PageServer(options.port, rig.stop, on_clear=rig.clear) as pages:
        participant = pages.participant
        name = _recording_name(rig, options, path.stem)
        remark = readiness.too_fast(rig)
        hand: Hand = (person := Person(participant.says_done, participant.begins, participant.sees))
        if rig.get_rig_info().kind == rig_pb2.RIG_KIND_SIMULATED:
            hand = PersonOnSimulatedRig(seed, path.stem, person=person)
        with RigStage(rig, hand, seed=seed, record_as=name, on_wait=participant.waits) as stage, contextlib.closing(begin(stage)) as journal:
            _say(
                options, f"the participant's page:   {pages.participant_url}\nthe experimenter's page:  {pages.experimenter_url}",
                participants_page=pages.participant_url, experimenters_page=pages.experimenter_url,
            )  # fmt: skip
            if remark:
                say(f"remark: {remark}", sys.stderr)
            begun = session.fold(journal.events)
            for event in journal.events:
                participant.notify(event)
            with Reporter(rig, begun.protocol.name, participant) as reporter:
                with ending.until_left():
                    state = runner.Runner(journal, stage, participant).run()
                reporter.ended(state.aborted)
        participant.goodbye()
    return _said(state, path, options)


def _said(state: session.State, path: Path, options: argparse.Namespace, *, was_done: bool = False) -> int:
    why = state.aborted or "interrupted"
    end = "was done already" if was_done else "done" if state.ended else f"ended early ({why})"
    if not state.ended and path.exists():
        end += f"; {_resuming(path)}"
    _say(
        options, f"{path}: {end}",
        journal=str(path), finished=state.ended, was_done_already=was_done, ended_because="" if state.ended else why,
    )  # fmt: skip
    return DONE if state.ended else NOT_FINISHED


def _simulate(options: argparse.Namespace) -> int:
    protocol = protocols.read(options.protocol)
    count = protocol.participants if options.participants is None else options.participants
    if count < 1:
        raise BadArgument("this is no number of participants", where="--participants", value=str(count), limit="≥ 1")
    if options.no_rig and protocol.kind == "rate":
        raise BadArgument("without a rig there is nothing to search in", where="--no-rig", value=protocol.name, limit="protocols that compare")
    if options.record and not options.every_trial:
        raise BadArgument("there is no session to record", where="--record", value="given", remedy="give --every-trial too, or leave it out")
    if options.only is not None and not 0 <= options.only < count:
        raise BadArgument("there is no such participant", where="--only", value=str(options.only), limit=f"0 … {count - 1}")
    chosen = dict(enumerate(simulated.group(count, options.seed)))
    if options.only is not None:
        chosen = {options.only: chosen[options.only]}
    codes = [DONE]
    simulation.run(
        simulation.Group(protocol, options.folder, chosen, options.seed), None,
        lambda state, path, was_done: codes.append(_said(state, path, options, was_done=was_done)),
        every_trial=options.every_trial, record=options.record, no_rig=options.no_rig,
    )  # fmt: skip
    return max(codes)


def _scan(options: argparse.Namespace) -> int:
    touches = touches_of(hapticd.open_recording(options.recording).data)
    text = surface_toml(touches, options.step, where=options.recording)
    with options.out.open("x", encoding="utf-8") as file:
        file.write(text)
    _say(options, f"{len(touches)} touches, {options.out}", touches=len(touches), file=str(options.out))
    return DONE


def _analyse(options: argparse.Namespace) -> int:
    sessions = analysis.read(options.journals)
    protocol = sessions[0].protocol
    found, rated = analysis.estimates(sessions, resamples=options.bootstrap), analysis.ratings(sessions)
    if options.json:
        say(json.dumps(analysis.as_json(sessions, found, rated), indent=2, ensure_ascii=False))
    else:
        say(analysis.text_of(sessions, found, rated))
    if options.figures is not None:
        options.figures.mkdir(parents=True, exist_ok=True)
        names = [one.name for one in protocol.conditions]
        if protocol.kind == "compare":
            plots.equality(found, names).savefig(options.figures / "equality.svg")
            for one in sessions:
                for condition in (name for name in names if one.is_done(name)):
                    plots.series(one, condition).savefig(options.figures / f"series_{one.participant}_{condition}.svg")
        else:
            plots.similarity(rated, names).savefig(options.figures / "similarity.svg")
        say(f"figures in {options.figures}", sys.stderr)
    return DONE


def _export(options: argparse.Namespace) -> int:
    sessions = analysis.read(options.journals)
    if options.out.suffix == ".csv":
        export.to_csv(sessions, options.out, psychopy=options.psychopy)
        _say(options, str(options.out), files=[str(options.out)])
    elif options.psychopy:
        raise BadArgument("PsychoPy's names are for one table", where="--out", value=str(options.out), limit="NAME.csv")
    else:
        files = [str(one) for one in export.to_bids(sessions, options.out, options.author)]
        _say(options, f"{len(files)} files in {options.out}", files=files)
    return DONE


if __name__ == "__main__":
    sys.exit(main())
