"""The pages of a session: a participant who answers over HTTP, faults in mid-trial, and the page in a browser."""

from __future__ import annotations

import http.client
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any, Callable, Iterator, Optional
from urllib.parse import urlsplit

import pytest

import hapticd
from console_page import started_browser
from hapticd import errors
from hapticd.experiment import analysis, export, journal, protocol, readiness, reporting, runner, stage
from hapticd.experiment.__main__ import main
from hapticd.experiment.page_person import PagePerson
from hapticd.experiment.page_server import PageServer
from hapticd.experiment.stage import BareStage
from hapticd.v1 import rig_pb2

PROTOCOL = """
name = "short"
title = "Two trials"
question = "Which felt harder?"
participants = 1
[answers]
keys = { 1 = "first", 2 = "second" }
[reference]
scene = "press_guided"
[comparison]
scene = "press_guided"
[procedure]
kind = "constant"
level_shares = [0.8, 1.2]
repetitions = 1
[trial]
highest_n_per_mm = 0.9
[session]
white_noise = NOISE
[presentation]
above_mm = [0, 0, 10]
[[condition]]
name = "only"
reference_n_per_mm = 0.4
"""


def written(folder: Path, noise: bool = False) -> Path:
    path = folder / "short.toml"
    path.write_text(PROTOCOL.replace("NOISE", str(noise).lower()))
    return path


class Page:
    """A participant's page without a browser."""

    def __init__(self, url: str, answers: Callable[[dict[str, Any]], Optional[str]]) -> None:
        self._place = urlsplit(url)
        self._answers = answers
        self.phases: list[str] = []
        self.is_open = True
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def post(self, message: Any, headers: dict[str, str] = {"X-Hapticd": "1"}) -> int:  # noqa: B006
        connection = http.client.HTTPConnection(self._place.netloc, timeout=10)
        connection.request("POST", f"/act?{self._place.query}", json.dumps(message), headers)
        return connection.getresponse().status

    def _run(self) -> None:
        connection = http.client.HTTPConnection(self._place.netloc, timeout=10)
        connection.request("GET", f"/events?{self._place.query}")
        response = connection.getresponse()
        last = ""
        while self.is_open and (line := response.readline()):
            if not line.startswith(b"data: "):
                continue
            state = json.loads(line[6:])
            shown = json.dumps({key: state.get(key) for key in ("phase", "text", "interval", "seconds_left", "page", "fault", "clear_refused")})
            if shown == last:
                continue
            last = shown
            self.phases.append(state["phase"])
            key = self._answers(state)
            if key is not None:
                self.post({"do": "key", "key": key, "after_ms": 500.0})
        connection.close()

    def close(self) -> None:
        self.is_open = False
        self._thread.join()


class Program:
    """hapticctl experiment …, whose addresses are read from what it prints."""

    def __init__(self, address: str, *arguments: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-u", "-m", "hapticd.experiment", *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            env={**os.environ, "HAPTICD_SERVER": address},
        )  # fmt: skip
        assert self.process.stdout is not None
        printed = self.process.stdout.readline() + self.process.stdout.readline()
        found = re.findall(r"http://\S+", printed)
        assert len(found) == 2, printed + self.process.stdout.read()
        self.participant, self.experimenter = found

    def end(self) -> int:
        try:
            self.process.communicate(timeout=180)
        finally:
            self.process.kill()
        return self.process.returncode


@pytest.fixture
def fast_daemon(start_daemon: Any, tmp_path: Path) -> Any:
    configuration = tmp_path / "rig.toml"
    configuration.write_text("[rig.sim]\nspeed = 20\n")
    return start_daemon("--model-store", ":memory:", "--config", str(configuration))


def await_that(condition: Callable[[], bool], seconds: float = 60.0) -> None:
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, "it did not happen"
        time.sleep(0.02)


def willing(state: dict[str, Any]) -> Optional[str]:
    return {"ready": " ", "question": "1"}.get(state["phase"])


def events_of(folder: Path) -> list[journal.Event]:
    return journal.read(folder / "short_P1.jsonl")


def kinds(events: list[journal.Event]) -> list[str]:
    return [event["event"] for event in events]


def test_a_session_at_the_page(start_daemon: Any, tmp_path: Path) -> None:
    configuration = tmp_path / "rig.toml"
    configuration.write_text(f'[rig.sim]\nspeed = 20\n[recording]\nfolder = "{tmp_path / "recordings"}"\n')
    daemon = start_daemon("--model-store", ":memory:", "--config", str(configuration))
    program = Program(daemon.address, "run", str(written(tmp_path)), "--participant", "P1", "--folder", str(tmp_path), "--port", "0")
    too_early: list[bool] = []

    def eager(state: dict[str, Any]) -> Optional[str]:
        if state["phase"] == "touch" and not too_early:
            too_early.append(True)
            return "2"
        return willing(state)

    page = Page(program.participant, eager)
    # Without the page's own header, with another's key, or with nonsense there is no way in.
    assert page.post({"do": "abort"}, {}) == 403
    assert Page(program.participant.replace("key=", "key=x"), willing).post({"do": "abort"}) == 403
    assert page.post({"do": "noise", "state": "running", "gain": "NaN"}) == 400
    assert page.post({"do": "key"}) == 400
    assert program.end() == 0
    events = events_of(tmp_path)
    assert kinds(events)[-1] == "end"
    answers = [event for event in events if event["event"] == "answer"]
    assert [event["answer"] for event in answers] == ["first", "first"]
    # A key before the question did not count as an answer, and is not forgotten.
    assert [event["key"] for event in events if event["event"] == "early"] == ["2"]
    assert page.phases.index("touch") < page.phases.index("question")
    # Each presentation joins to its telemetry by the ticks.
    shown = [event for event in events if event["event"] == "presentation"]
    with hapticd.connect(daemon.address) as rig:
        rig.download_recording(tmp_path / "session.mcap", shown[0]["recording"])
    ticks = hapticd.open_recording(tmp_path / "session.mcap").data.ticks
    assert all(event["recording"] == shown[0]["recording"] for event in shown)
    # At twenty times its speed a busy machine loses ticks of the recording, and says so: most are there.
    for event in shown:
        length = event["end_tick"] - event["begin_tick"] + 1
        assert ticks[0] <= event["begin_tick"] <= event["end_tick"] <= ticks[-1]
        assert sum((ticks >= event["begin_tick"]) & (ticks <= event["end_tick"])) > length / 2


def test_a_page_that_is_closed_and_a_session_that_is_stopped(fast_daemon: Any, tmp_path: Path) -> None:
    arguments = ("run", str(written(tmp_path)), "--participant", "P1", "--folder", str(tmp_path), "--port", "0", "--no-record")
    program = Program(fast_daemon.address, *arguments)
    page = Page(program.participant, willing)
    await_that(lambda: "touch" in page.phases)
    page.close()
    path = tmp_path / "short_P1.jsonl"
    # Nothing goes on without it; with it, the session does.
    is_here = [True]
    experimenter = Page(program.experimenter, lambda state: is_here.append(state["page"]))
    await_that(lambda: not is_here[-1])
    before = path.read_bytes()
    time.sleep(0.5)  # in which nothing happens: at this rig's speed both trials would be over
    assert path.read_bytes() == before
    experimenter.close()
    page = Page(program.participant, willing)
    await_that(lambda: any(event["event"] == "answer" for event in events_of(tmp_path)))
    Page(program.experimenter, lambda state: None).post({"do": "abort"})
    assert program.end() == 5
    assert events_of(tmp_path)[-1]["event"] == "abort"
    with hapticd.connect(fast_daemon.address) as rig:
        assert rig.get_rig_state().guard_state == rig_pb2.GUARD_STATE_LATCHED
        rig.clear()
    program = Program(fast_daemon.address, "resume", str(path), "--port", "0", "--no-record")
    page = Page(program.participant, willing)
    assert program.end() == 0
    assert kinds(events_of(tmp_path))[-1] == "end"


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM, signal.SIGHUP])
def test_a_session_that_was_ended_goes_on_by_one_command(start_daemon: Any, tmp_path: Path, how: signal.Signals) -> None:
    configuration = tmp_path / "rig.toml"
    configuration.write_text(f'[rig.sim]\nspeed = 20\n[recording]\nfolder = "{tmp_path / "recordings"}"\n')
    daemon = start_daemon("--model-store", ":memory:", "--config", str(configuration))
    path = tmp_path / "short_P1.jsonl"
    program = Program(daemon.address, "run", str(written(tmp_path)), "--participant", "P1", "--folder", str(tmp_path), "--port", "0")
    Page(program.participant, willing)
    await_that(lambda: path.exists() and any(event["event"] == "answer" for event in events_of(tmp_path)))
    program.process.send_signal(how)
    status = program.end()
    with hapticd.connect(daemon.address) as rig:
        if how != signal.SIGKILL:  # in order, as by Ctrl-C
            assert status == 5
            assert not rig.get_lease().HasField("lease") and rig.get_rig_state().recording == ""
            assert rig.get_rig_state().guard_state != rig_pb2.GUARD_STATE_LATCHED
        program = Program(daemon.address, "resume", str(path), "--port", "0")
        page = Page(program.participant, willing)
        seen: list[dict[str, Any]] = []
        Page(program.experimenter, lambda state: seen.append(state) and None)
        assert program.end() == 0
        assert kinds(events_of(tmp_path))[-1] == "end" and page.phases[-1] == "done"
        # Also those before the end; a page that is opened at once shows a state before there is a count.
        assert next(state for state in seen if "answered" in state)["answered"] >= 1
        recordings = rig.list_recordings().recordings
    assert len(recordings) == 2 and all(one.end_reason for one in recordings)
    # Each row counts from the begin of the recording that it names.
    rows = export.rows(analysis.read([path])[0])
    assert {row["recording"] for row in rows} == {one.id for one in recordings}
    assert all(row["onset"] is not None and row["onset"] >= 0.0 for row in rows)
    for one in recordings:
        assert max(row["onset"] for row in rows if row["recording"] == one.id) <= one.duration_s + 1.0


def test_the_experimenters_page_clears_and_the_session_goes_on(fast_daemon: Any, tmp_path: Path) -> None:
    arguments = ("run", str(written(tmp_path)), "--participant", "P1", "--folder", str(tmp_path), "--port", "0", "--no-record")
    program = Program(fast_daemon.address, *arguments)
    page = Page(program.participant, willing)
    seen: list[dict[str, Any]] = [{}]
    experimenter = Page(program.experimenter, lambda state: seen.append(state) and None)
    await_that(lambda: "touch" in page.phases)
    with hapticd.connect(fast_daemon.address) as other:
        for times in (1, 2):  # also a second time, while the first trial is presented again
            other.stop("test")
            await_that(lambda: seen[-1].get("fault") == "stopped")
            assert page.post({"do": "clear"}) == 400  # it is not for the participant
            assert experimenter.post({"do": "clear"}) == 200
            await_that(lambda: not seen[-1].get("fault"))
            if times == 1:
                count = page.phases.count("touch")
                await_that(lambda: page.phases.count("touch") > count)
    assert program.end() == 0
    events = events_of(tmp_path)
    assert kinds(events)[-1] == "end" and kinds(events).count("answer") == 2 and "discarded" in kinds(events)


def test_a_clear_that_is_refused_is_said() -> None:
    def refuse() -> None:
        raise errors.Stopped("the fault is still there", where="device")

    person = PagePerson(lambda why: None, on_clear=refuse)
    person.force_is("device_fault")
    person.clear()
    shown = person.view("experimenter", -1, 0.0)[1]
    assert shown["fault"] == "device_fault" and "still there" in shown["clear_refused"]
    with pytest.raises(stage.Interrupted):
        person.seen()
        person.says_done()
    person.force_is("")
    assert not person.says_done() and not person.view("experimenter", -1, 0.0)[1]["clear_refused"]


def test_what_cannot_begin_leaves_no_journal(fast_daemon: Any, tmp_path: Path) -> None:
    with hapticd.connect(fast_daemon.address) as rig, PageServer(0, lambda why: None) as other:
        port = urlsplit(other.participant_url).port
        command = [sys.executable, "-m", "hapticd.experiment", "run", str(written(tmp_path)), "--participant", "P1", "--folder", str(tmp_path)]
        tries = [["--no-record", "--port", str(port)], ["--port", "0"]]  # the pages have no place; there is no folder for recordings
        for more in tries:
            done = subprocess.run([*command, *more], capture_output=True, text=True, env={**os.environ, "HAPTICD_SERVER": fast_daemon.address})
            assert done.returncode == 1 and "Traceback" not in done.stderr, done.stderr
        assert not list(tmp_path.glob("*.jsonl")) and not rig.get_lease().HasField("lease")


@pytest.mark.parametrize("error, ends", [(errors.Unreachable, True), (errors.Refused, False)])
def test_a_lost_daemon_ends_the_session_and_one_that_refuses_does_not(monkeypatch: pytest.MonkeyPatch, error: Any, ends: bool) -> None:
    monkeypatch.setattr(reporting, "LOST_AFTER_S", 0.2)
    monkeypatch.setattr(reporting, "HEARTBEAT_S", 0.05)
    person = PagePerson(lambda why: None)

    class Daemon:
        reports = 0

        def report_experiment(self, **_: Any) -> None:
            self.reports += 1
            raise error("gone")

        def get_rig_state(self) -> None:
            raise error("gone")

    daemon: Any = Daemon()
    reason = ""
    with reporting.Reporter(daemon, "short", person):
        while not reason and daemon.reports < 5:
            person.seen()
            try:
                person.says_done()
            except stage.Aborted as end:
                reason = str(end)
            time.sleep(0.01)
    assert ("no longer answers" in reason) == ends


def test_a_participant_is_not_taken_twice_and_a_wrong_file_is_named(
    fast_daemon: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("HAPTICD_SERVER", fast_daemon.address)
    chosen = written(tmp_path)
    runner.begin(tmp_path, protocol.read(str(chosen)), "P1", 0, 1, {}).close()

    def said(*arguments: str) -> tuple[int, str]:
        return main(list(arguments)), capsys.readouterr().err

    status, text = said("run", str(chosen), "--participant", "P1", "--folder", str(tmp_path), "--port", "0", "--no-record")
    assert status == 1 and "journal of this participant already" in text
    chosen.write_text(chosen.read_text().replace("repetitions", "repetition"))
    status, text = said("check", str(chosen), "--no-rig")
    assert status == 1 and "did you mean" in text or "missing" in text
    status, text = said("resume", str(tmp_path / "short_P1.jsonl"), "--protocol", "stiffness_1d", "--port", "0")
    assert status == 1 and "another protocol" in text
    status, text = said("check", "no_such")
    assert status == 1 and "stiffness_1d" in text


def test_a_rig_that_is_too_fast_for_a_person_is_named(
    fast_daemon: Any, start_daemon: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("HAPTICD_SERVER", fast_daemon.address)
    main(["check", str(written(tmp_path))])
    said = capsys.readouterr().out
    assert "times as fast as the clock" in said and "remove speed from [rig.sim]" in said
    with hapticd.connect(start_daemon().address) as rig:
        assert readiness.too_fast(rig) == ""


def test_an_interrupted_session_names_the_command_that_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(options: Any) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr("hapticd.experiment.__main__._resume", interrupted)
    path = tmp_path / "one's own" / "short_P1.jsonl"
    assert main(["resume", str(path)]) == 5 and capsys.readouterr().err == "ended\n"
    path.parent.mkdir()
    path.touch()
    assert main(["resume", str(path)]) == 5
    words = shlex.split(capsys.readouterr().err)
    assert words[:5] == ["ended;", "hapticctl", "experiment", "resume", str(path)]


@pytest.fixture
def browser(tmp_path: Path) -> Iterator[Any]:
    yield from started_browser(tmp_path / "profile", "disable-gpu", "autoplay-policy=no-user-gesture-required", size=(1280, 800))


def test_the_page_in_a_browser(browser: Any, tmp_path: Path) -> None:
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
    from selenium.webdriver.support.ui import WebDriverWait

    chosen = protocol.read(str(written(tmp_path, noise=True)))
    opened = runner.begin(tmp_path, chosen, "P1", 0, 1, {})
    stops: list[str] = []
    with PageServer(0, stops.append, PagePerson(stops.append, patience_s=60.0)) as pages:
        session = threading.Thread(target=runner.Runner(opened, BareStage(chosen, 1, "P1"), pages.participant).run)
        browser.get(pages.participant_url)
        session.start()

        def phase_is(wanted: str) -> None:
            WebDriverWait(browser, 20).until(lambda b: b.find_element(By.TAG_NAME, "body").get_attribute("data-phase") == wanted)

        def press(key: str) -> None:
            browser.find_element(By.TAG_NAME, "body").send_keys(key)

        phase_is("ready")
        press(" ")  # before the noise is on: nothing begins
        browser.find_element(By.ID, "begin").click()
        for _ in range(2):
            for which in ("first", "second"):
                WebDriverWait(browser, 20).until(lambda b: f"space to feel the {which}" in b.find_element(By.ID, "text").text)
                press(Keys.SPACE)
            phase_is("question")
            assert "Which felt harder?" in browser.find_element(By.ID, "text").text
            if folder := os.environ.get("HAPTICD_SCREENSHOTS"):
                browser.save_screenshot(f"{folder}/question.png")
            press("2")
        session.join(30)
    events = opened.events
    assert kinds(events)[-1] == "end"
    assert [event["answer"] for event in events if event["event"] == "answer"] == ["second", "second"]
    noise = [event for event in events if event["event"] == "noise"]
    assert len(noise) == 4 and all(event["state"] == "running" for event in noise)
    assert not [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]
