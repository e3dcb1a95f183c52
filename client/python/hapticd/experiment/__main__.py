"""hapticctl experiment, or python3 -m hapticd.experiment: experiments from the command line."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any, Optional, Sequence

import hapticd
from hapticd._shown import printable, say
from hapticd.errors import BadArgument, HapticdError, Refused, Unreachable
from hapticd.experiment import analysis, export, plots, runner, session, simulated
from hapticd.experiment import protocol as protocols
from hapticd.experiment.hands import Hand, Person, PersonOnSimulatedRig, SimulatedHand
from hapticd.experiment.journal import Journal
from hapticd.experiment.rig_stage import RigStage
from hapticd.experiment.scan import surface_toml, touches_of
from hapticd.experiment.stage import BareStage, Stage
from hapticd.v1 import rig_pb2

DONE, REFUSED, USAGE, UNREACHABLE, NOT_FINISHED = 0, 1, 2, 3, 5
EXIT_CODES = "exit codes: 0 done; 1 refused, or a file is not what it should be; 2 wrong usage; 3 no daemon; 5 the session was ended early"


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Exit code."""
    options = _parser().parse_args(arguments)
    try:
        return int(options.do(options))
    except Unreachable as error:
        say(f"hapticctl: {printable(str(error))}", sys.stderr)
        return UNREACHABLE
    except HapticdError as error:
        say(f"hapticctl: {printable(str(error))}", sys.stderr)
        return REFUSED
    except OSError as error:
        say(f"hapticctl: {printable(str(error))}", sys.stderr)
        return REFUSED
    except KeyboardInterrupt:
        say("ended; hapticctl experiment resume goes on with it", sys.stderr)
        return NOT_FINISHED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="hapticctl experiment", description="Perception experiments.", epilog=EXIT_CODES)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def command(name: str, do: Any, about: str) -> argparse.ArgumentParser:
        one: argparse.ArgumentParser = commands.add_parser(name, help=about, description=about + ".", epilog=EXIT_CODES)
        one.set_defaults(do=do)
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
    simulate.add_argument("--record", action="store_true", help="have the daemon record the sessions")

    scan = command("scan", _scan, "From a recording of touches to the section [wall.surface] of a scene")
    scan.add_argument("recording", help="MCAP or HDF5, with light touches all over the object")
    scan.add_argument("--step", type=float, default=5.0, help="of the grid, mm; 5 if not given")
    scan.add_argument("--out", type=Path, required=True, help="a new file")

    analyse = command("analyse", _analyse, "Estimates and figures of sessions")
    analyse.add_argument("journals", type=Path, nargs="+", help="journals, or folders of them")
    analyse.add_argument("--figures", type=Path, help="a folder for figures (SVG); needs python3-matplotlib")
    analyse.add_argument("--bootstrap", type=int, default=0, metavar="N", help="intervals by N resamples, for constant stimuli")
    analyse.add_argument("--json", action="store_true", help="for programs")

    exported = command("export", _export, "Sessions as BIDS or CSV")
    exported.add_argument("journals", type=Path, nargs="+", help="journals, or folders of them")
    exported.add_argument("--out", type=Path, required=True, help="a new folder (BIDS), or a new file NAME.csv")
    exported.add_argument("--psychopy", action="store_true", help="answers only, under PsychoPy's names; CSV")
    return parser


def _versions(rig: Optional[hapticd.Rig]) -> dict[str, str]:
    if rig is None:
        return {}
    info = rig.get_rig_info()
    return {"hapticd": info.server_version, "rig": info.name}


def _check(options: argparse.Namespace) -> int:
    protocol = protocols.read(options.protocol)
    say(f"{protocol.title} ({protocol.source}), {protocol.participants} participants, sha256 {protocol.sha256[:12]}")
    for condition in protocol.conditions:
        target = f", target {condition.reference_n_per_mm:g} N/mm" if protocol.kind == "compare" else ""
        say(f"  {condition.name}: {analysis.stimulus_name(condition.reference)} against {analysis.stimulus_name(condition.comparison)}{target}")
    if not options.no_rig:
        with hapticd.connect() as rig, RigStage(rig, Person(lambda: True)) as stage:
            stage.check(protocol)
        say("this rig can do all of it")
    return DONE


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


def _run(options: argparse.Namespace) -> int:
    protocol = protocols.read(options.protocol)
    number = runner.numbers_used(options.folder, protocol) if options.number is None else options.number
    with hapticd.connect() as rig:
        with RigStage(rig, Person(lambda: True)) as stage:
            stage.check(protocol)  # before there is a journal
        _recording_name(rig, options, "")
        journal = runner.begin(options.folder, protocol, options.participant, number, options.seed, _versions(rig))
        return _session(rig, journal, options)


def _resume(options: argparse.Namespace) -> int:
    wanted = protocols.read(options.protocol) if options.protocol else None
    journal = runner.resume(options.journal, wanted)
    with hapticd.connect() as rig:
        return _session(rig, journal, options)


def _session(rig: hapticd.Rig, journal: Journal, options: argparse.Namespace) -> int:
    from hapticd.experiment.page_server import PageServer
    from hapticd.experiment.reporting import Reporter

    with PageServer(options.port, rig.stop) as pages:
        participant = pages.participant
        say(f"the participant's page:   {pages.participant_url}\nthe experimenter's page:  {pages.experimenter_url}")
        name = _recording_name(rig, options, journal.path.stem)
        begun = session.fold(journal.events)
        seed = begun.seed
        hand: Hand = (person := Person(participant.says_done, participant.begins, participant.sees))
        if rig.get_rig_info().kind == rig_pb2.RIG_KIND_SIMULATED:
            hand = PersonOnSimulatedRig(seed, journal.path.stem, person=person)
        try:
            on_rig = RigStage(rig, hand, seed=seed, record_as=name, on_wait=participant.waits)
            with on_rig as stage, Reporter(rig, begun.protocol.name, participant) as reporter:
                state = runner.Runner(journal, stage, participant).run()
                reporter.ended(state.aborted)
        finally:
            journal.close()
        participant.goodbye()
    return _said(state, journal.path)


def _said(state: session.State, path: Path) -> int:
    if state.ended:
        say(f"{path}: done")
        return DONE
    say(f"{path}: ended early ({state.aborted or 'interrupted'}); hapticctl experiment resume {path}")
    return NOT_FINISHED


def _simulate(options: argparse.Namespace) -> int:
    protocol = protocols.read(options.protocol)
    count = protocol.participants if options.participants is None else options.participants
    if count < 1:
        raise BadArgument("this is no number of participants", where="--participants", value=str(count), limit="≥ 1")
    if options.no_rig and protocol.kind == "rate":
        raise BadArgument("without a rig there is nothing to search in", where="--no-rig", value=protocol.name, limit="protocols that compare")
    observers = simulated.group(count, options.seed)
    if options.only is not None and not 0 <= options.only < count:
        raise BadArgument("there is no such participant", where="--only", value=str(options.only), limit=f"0 … {count - 1}")
    codes = DONE
    for number, observer in enumerate(observers):
        if options.only is not None and number != options.only:
            continue
        path = options.folder / f"{protocol.name}_{observer.name}.jsonl"
        rig = None if options.no_rig else hapticd.connect()
        try:
            if path.exists():
                journal = runner.resume(path, protocol)
            else:
                journal = runner.begin(options.folder, protocol, observer.name, number, options.seed, _versions(rig))
            participant = simulated.SimulatedParticipant(observer)
            try:
                if rig is None:
                    stage: Stage = BareStage(protocol, options.seed, observer.name)
                    state = runner.Runner(journal, stage, participant).run()
                else:
                    name = path.stem if options.record else ""
                    with RigStage(rig, SimulatedHand.of(observer), seed=options.seed, record_as=name, wait_for_clear_s=0.0) as on_rig:
                        state = runner.Runner(journal, on_rig, participant).run()
            finally:
                journal.close()
        finally:
            if rig is not None:
                rig.close()
        codes = max(codes, _said(state, path))
    return codes


def _scan(options: argparse.Namespace) -> int:
    touches = touches_of(hapticd.open_recording(options.recording).data)
    text = surface_toml(touches, options.step)
    with options.out.open("x", encoding="utf-8") as file:
        file.write(text)
    say(f"{len(touches)} touches, {options.out}")
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
        say(options.out)
    elif options.psychopy:
        raise BadArgument("PsychoPy's names are for one table", where="--out", value=str(options.out), limit="NAME.csv")
    else:
        say(f"{len(export.to_bids(sessions, options.out))} files in {options.out}")
    return DONE


if __name__ == "__main__":
    sys.exit(main())
