"""Sessions whose program is killed (SIGKILL) after each of their events, and resumed: does the journal end as if nothing had been?"""

from __future__ import annotations

import os
import signal
import tempfile
from pathlib import Path

from hapticd.experiment import journal, protocol, runner, session
from hapticd.experiment.simulated import SimulatedParticipant, group
from hapticd.experiment.stage import BareStage

import study_output

SEED = 5


def run(path: Path, chosen: protocol.Protocol, kill_after: int = 0) -> None:
    """Runs in a separate process; kill_after: events, 0: to the end."""
    child = os.fork()
    if child:
        os.waitpid(child, 0)
        return
    observer = group(1, SEED)[0]

    class Participant(SimulatedParticipant):
        events = 0

        def notify(self, event: journal.Event) -> None:
            self.events += 1
            if self.events == kill_after:
                os.kill(os.getpid(), signal.SIGKILL)

    try:
        opened = runner.resume(path, chosen) if path.exists() else runner.begin(path.parent, chosen, observer.name, 0, SEED, {})
        stage = BareStage(chosen, SEED, observer.name, flawed_share=0.1)
        runner.Runner(opened, stage, Participant(observer)).run()
    finally:
        os._exit(0)


def main() -> None:
    options = study_output.options(__doc__)
    output = study_output.Output(options.out, "resume", "Sessions that were killed")
    rows = []
    # After each event of a staircase session, and after some of a session by limits, which is three times as long.
    for name, stride in (("stiffness_3d", 1), ("stiffness_1d", 40)):
        chosen = protocol.read(name)
        with tempfile.TemporaryDirectory() as folder:
            whole = Path(folder) / "whole" / f"{name}_S01.jsonl"
            run(whole, chosen)
            expected = whole.read_bytes()
            events = len(expected.splitlines())
            state = session.fold(journal.read(whole))
            assert state.ended
            mismatches = 0
            kills = range(1, events, 120 if options.quick else stride)
            for kill_after in kills:
                path = Path(folder) / f"killed_{kill_after}" / whole.name
                run(path, chosen, kill_after)
                run(path, chosen)
                mismatches += path.read_bytes() != expected
                path.unlink()
        output.figure("resume_mismatches", mismatches, {"protocol": name, "kills": len(kills)}, goal=0, source="byte for byte")
        rows.append([name, str(events), str(len(kills)), str(mismatches)])
    output.table(
        "Journals after kill −9 and resume, beside one that was never interrupted",
        ["protocol", "events", "kills", "journals that differ"],
        rows,
    )


if __name__ == "__main__":
    main()
