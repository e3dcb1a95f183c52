"""The console as a person uses it: every view against a daemon on the simulated rig, in a headless browser."""

from __future__ import annotations

import contextlib
import os
import re
import signal
from pathlib import Path
from typing import Any

import pytest

import hapticd
from console_page import SIZE, Page, browser, configuration, page  # noqa: F401
from hapticd.v1 import rig_pb2

OPTIONS = ("--scene", "tap_1d")


@pytest.fixture
def daemon(start_daemon: Any, start_console: Any, tmp_path: Path) -> Any:
    daemon = start_daemon(*OPTIONS, "--model-store", str(tmp_path / "models.sqlite"), *configuration(tmp_path))
    start_console()
    return daemon


def opened(page: Page, daemon: Any) -> Page:
    with hapticd.connect(daemon.address) as rig:
        page.open(rig.open_console().url)
    return page


def state_of(daemon: Any) -> Any:
    with hapticd.connect(daemon.address) as rig:
        return rig.get_rig_state(without_histograms=True)


def pictured(page: Page, name: str) -> None:
    if folder := os.environ.get("HAPTICD_SCREENSHOTS"):
        page.driver.save_screenshot(f"{folder}/{name}.png")


def test_a_sponge_is_pressed_at_two_stiffnesses(page: Page, daemon: Any) -> None:  # noqa: F811
    opened(page, daemon)
    page.view("scene")
    page.choose("simulated object", "sponge_block")
    page.click("Put it under the tool")
    page.says("sponge_block is under the tool")
    page.click("Press again and again")
    page.says("The simulated hand")
    for stiffness in ("0.3", "0.8"):
        page.enter("target stiffness in N/mm", stiffness)  # the slider is the first of this name
        page.says(f"{float(stiffness):.3f} N/mm")
        page.wait(lambda: abs(state_of(daemon).target_stiffness_n_per_mm - float(stiffness)) < 1e-3)
    # More than the scene allows is granted in part, and the page says why.
    page.run("const n = document.querySelector('input[type=number][aria-label^=target]'); n.value = 5; n.dispatchEvent(new Event('change'));")
    page.says("1.000 N/mm")
    page.says("scene maximum")
    page.wait(lambda: "(now)" in page.text())
    pictured(page, "scene")
    # What is felt lies on the target's line.
    page.view("live")
    page.says("every tick")
    slopes = page.driver.execute_async_script("""
        const done = arguments[0], rows = [];
        const api = await import('/api.js');
        const t = api.telemetry({columns: ['contact_in_contact', 'deformation_displacement_mm', 'control_hand_force_n', 'guard_authority'],
          rows: ({data, count, width, samples}) => {
            for (let i = 0; samples === 1 && i < count; ++i) if (data[i * width + 1] > 2) rows.push(data[i * width + 2] / data[i * width + 1]);
            if (rows.length > 1000) { t.close(); done(rows.sort((a, b) => a - b)); }
          }});""")  # fmt: skip
    assert slopes[len(slopes) // 2] == pytest.approx(1.0, rel=0.2)
    page.wait(lambda: page.run("return liveStats.frames") > 20)
    pictured(page, "live")
    page.click("Pause")
    page.run("window.saved = null; const make = URL.createObjectURL; URL.createObjectURL = (b) => { b.text().then((t) => { window.saved = t; }); return make(b); }")
    page.click("Save as CSV")
    lines = str(page.wait(lambda: page.run("return window.saved"))).splitlines()
    assert lines[0].startswith("time_s,contact_reaction_force_n") and len(lines) > 100
    assert page.problems() == []


def test_stop_works_by_key_and_by_button_and_says_why_there_is_no_force(page: Page, daemon: Any) -> None:  # noqa: F811
    opened(page, daemon)
    from selenium.webdriver.common.keys import Keys

    page.driver.find_element("tag name", "body").send_keys(Keys.ESCAPE)
    page.says("no force: stopped", "#state")
    assert state_of(daemon).guard_state == rig_pb2.GUARD_STATE_LATCHED
    page.view("now")
    page.says("someone asked for it")
    page.says("clear when the reason is gone")
    pictured(page, "now_stopped")
    page.click("Clear: let the force return")
    page.says("Cleared stopped")
    page.wait(lambda: state_of(daemon).guard_state in (rig_pb2.GUARD_STATE_RESUMING, rig_pb2.GUARD_STATE_RENDERING))
    # Without a scene nothing is rendered, and nothing is estimated.
    with hapticd.connect(daemon.address) as rig:
        rig.unload_scene()
    page.says("no force: no scene is loaded")
    page.says("None. Without a scene there is no force.")
    assert "unspecified" not in page.text()
    # In an input field, and while the socket is stuck, too.
    page.view("scene")
    page.says("feasible: not known, no scene is loaded")
    page.run("window.WebSocket = function () { throw new Error('stuck'); };")
    page.field("hand force in N").send_keys(Keys.ESCAPE)
    page.wait(lambda: state_of(daemon).guard_state == rig_pb2.GUARD_STATE_LATCHED)
    assert "stopped by user:" in daemon.log.read_text() and "at console 127.0.0.1:" in daemon.log.read_text()


def test_an_object_is_identified(page: Page, start_daemon: Any, start_console: Any, tmp_path: Path) -> None:  # noqa: F811
    daemon = start_daemon(*OPTIONS, "--model-store", str(tmp_path / "models.sqlite"), *configuration(tmp_path, "[rig.sim]\nspeed = 10\n"))
    start_console()
    opened(page, daemon)
    page.view("identify")
    page.wait(lambda: page.field("name of the object").get_attribute("value") == "sponge_block")
    # On a simulated rig the hand does what is asked for; the page says what that is.
    page.run("window.told = new Set(); const big = document.querySelector('.big'); new MutationObserver(() => told.add(big.textContent)).observe(big, "
             "{childList: true, characterData: true, subtree: true})")  # fmt: skip
    page.click("Begin")
    page.says("runs")
    page.wait(lambda: "is kept" in page.text(), 120.0)
    assert any(re.search("press|hold|lift", text, re.IGNORECASE) for text in page.run("return [...told]")), page.run("return [...told]")
    assert page.shows("canvas[aria-label=coverage]")
    pictured(page, "identify")
    page.view("objects")
    page.says("contact")
    assert page.shows("main input[type=checkbox]")
    assert page.run(UNNAMED_COLUMNS) == []
    pictured(page, "objects")
    assert page.problems() == []


#: The colours in the plot.
DRAWN = """
    const c = document.querySelector('main canvas.traces'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
    const seen = new Set(); for (let i = 0; i < d.length; i += 4) seen.add(d[i] << 16 | d[i + 1] << 8 | d[i + 2]); return [...seen];"""


def test_a_recording_is_read_and_an_incident_explained(page: Page, daemon: Any) -> None:  # noqa: F811
    opened(page, daemon)
    page.view("recordings")
    page.enter("name of the recording", "press")
    page.click("Start")
    page.says("whatever becomes of this page")
    begun = state_of(daemon).tick
    page.wait(lambda: state_of(daemon).tick > begun + 1000)
    page.click("Stop recording")
    page.says(" rows.")
    page.click("Stop Esc", "header")
    page.wait(lambda: state_of(daemon).last_incident)
    page.wait(lambda: (page.click("Read again"), "incident: stopped" in page.text())[1])
    page.click("show")  # the newest
    page.says("someone asked for it")
    page.says("stopped: zero force")
    # The plot shows the last second before the cut: a line is drawn.
    page.wait(lambda: {0x0072B2, 0xB3261E} <= set(page.run(DRAWN)))
    pictured(page, "incident")
    page.choose("kind", "recordings")
    page.wait(lambda: "incident:" not in page.text(".scroll"))
    page.click("show")
    page.says("press", "main .card:last-child h3")
    assert page.run("return document.querySelectorAll('th').length") > 0 and page.run(UNNAMED_COLUMNS) == []
    assert page.problems() == []


#: Marks of a plot, as placeLabels() has them: bad ones keep their place, none covers another.
LABELS = """
    return import('/mark_labels.js').then(({placeLabels}) => placeLabels(
        [{x: 60, text: 'recording'}, {x: 62, text: 'command'}, {x: 63, text: 'a note of what was done that is far too long for it'},
         {x: 64, text: 'fault', bad: true}, {x: 65, text: 'turntable'}, {x: 640, text: 'the end'}], (text) => 7 * text.length, 650));"""


def test_words_over_a_plot_do_not_cover_each_other(page: Page, daemon: Any) -> None:  # noqa: F811
    opened(page, daemon)
    labels = page.run(LABELS)
    assert {label["text"] for label in labels} >= {"fault", "the end"} and len(labels) == 4
    for one in labels:
        assert one["x"] + 7 * len(one["text"]) <= 650 and len(one["text"]) <= 32
        for other in labels:
            apart = one["row"] != other["row"] or one["x"] + 7 * len(one["text"]) < other["x"] or other["x"] + 7 * len(other["text"]) < one["x"]
            assert one is other or apart, labels


def pressed_on_disk(folder: Path) -> bool:
    """Whether what a recording has on the disk is a second at least, and shows a press."""
    for path in folder.rglob("*.mcap"):
        with contextlib.suppress(hapticd.BadFile):  # nothing whole yet
            data = hapticd.open_recording(path).data
            return len(data) > 1000 and bool(data["contact_reaction_force_n"].max() > 1.0)
    return False


@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGKILL])
def test_the_recording_of_a_daemon_before_is_read(end: signal.Signals, page: Page, start_daemon: Any, start_console: Any, tmp_path: Path) -> None:  # noqa: F811
    options = (*OPTIONS, "--model-store", str(tmp_path / "models.sqlite"), *configuration(tmp_path))
    yesterday = start_daemon(*options)
    with hapticd.connect(yesterday.address) as rig:
        rig.set_hand_program({"kind": "press", "force_n": 3.0, "repetitions": -1})
        rig.start_recording("press", note="with the sponge")
        page.wait(lambda: pressed_on_disk(tmp_path / "recordings"), every=0.3)
    yesterday.end(end)  # while it records
    today = start_daemon(*options)
    start_console()
    opened(page, today)
    page.view("recordings")
    page.says("with the sponge")
    page.choose("kind", "recordings")
    page.wait(lambda: "incident:" not in page.text(".scroll"))
    page.click("show")
    page.says("press", "main .card:last-child h3")
    page.says("with the sponge", "main .card:last-child")
    page.wait(lambda: 0x0072B2 in set(page.run(DRAWN)))
    pictured(page, "recording")
    assert page.problems() == []


def test_the_other_views_show_what_there_is(page: Page, daemon: Any) -> None:  # noqa: F811
    opened(page, daemon)
    page.says("Nothing with hardware behind it")
    page.says("user:")
    page.view("turntable")
    page.says("this rig has no turntable")
    page.view("experiment")
    page.says("this scene has none")
    assert page.driver.find_element("id", "force").value_of_css_property("visibility") == "hidden"
    page.view("poses")
    page.says("mm")
    page.view("log")
    page.says("with the scene tap_1d")
    page.click("take control", "header")
    page.says("you have control", "#lease")
    with hapticd.connect(daemon.address) as rig, pytest.raises(hapticd.HapticdError, match="console"):
        rig.load_scene(name="wall")
    page.view("scene")
    page.choose("scene", "wall")
    page.click("Load")
    page.says("Loaded from tick")
    page.click("you have control", "header")
    page.says("take control", "#lease")
    page.view("log")
    page.says("load scene: name \"wall\"")
    assert page.problems() == []


def test_a_session_of_an_experiment_is_seen_blind(page: Page, daemon: Any) -> None:  # noqa: F811
    opened(page, daemon)
    with hapticd.connect(daemon.address) as rig:
        rig.load_scene(name="press_guided")
        page.view("experiment")
        page.says("none runs")
        rig.begin_presentation()
        page.says("number 1 runs")
        rig.end_presentation()
        page.says("never touched", "main .card:last-child")
        # What the program that runs the session reports.
        with rig.lease("experiment"):
            reported = {"protocol": "stiffness_3d", "participant": "S7", "conditions": 8, "answered": 13, "presented": 27}
            rig.report_experiment(**reported, phase="touch", condition=3, trial=14, discarded=1, last_flaws=["lateral_path"])
            page.says("S7, stiffness_3d")
            for said in ("the participant touches", "3 of 8", "lateral path", "closed"):
                page.says(said)
            pictured(page, "experiment")
            rig.report_experiment(**reported, phase="aborted", condition=3, ended_because="the page was closed")
            page.says("ended early: the page was closed")
    assert "N/mm" not in page.text() and "N/mm" not in page.text("header")


def test_a_daemon_that_is_gone_or_stands_still_is_shown_and_the_page_comes_back(page: Page, start_daemon: Any, start_console: Any, tmp_path: Path) -> None:  # noqa: F811,E501
    options = (*OPTIONS, "--model-store", ":memory:", *configuration(tmp_path))
    first = start_daemon(*options)
    start_console("--state", str(tmp_path))
    opened(page, first)
    first.process.send_signal(signal.SIGSTOP)
    page.wait(lambda: page.shows("body.away"))
    first.process.send_signal(signal.SIGCONT)
    page.wait(lambda: not page.shows("body.away"))
    first.end(signal.SIGKILL)
    page.wait(lambda: page.shows("body.away"))
    page.says("not connected", "#state")
    page.says("The daemon does not answer", "#notice")
    # The console is the same, and knows its browsers.
    start_daemon(*options)
    page.wait(lambda: not page.shows("body.away"))
    page.says("rendering", "#state")


def test_a_console_that_was_killed_comes_back_with_its_pages_and_the_rig_goes_on(
    page: Page, start_daemon: Any, start_console: Any, tmp_path: Path  # noqa: F811
) -> None:
    daemon = start_daemon(*OPTIONS, "--model-store", ":memory:", *configuration(tmp_path))
    console = start_console("--state", str(tmp_path))
    opened(page, daemon)
    with hapticd.connect(daemon.address) as rig:
        rig.set_hand_program({"kind": "press", "force_n": 3.0, "repetitions": -1})
    page.wait(lambda: state_of(daemon).in_contact)
    console.end(signal.SIGKILL)
    page.wait(lambda: page.shows("body.away"))
    before = state_of(daemon)
    assert before.guard_state == rig_pb2.GUARD_STATE_RENDERING
    start_console("--state", str(tmp_path), port=console.port)
    page.wait(lambda: not page.shows("body.away"))  # still signed in: the secret is the same
    page.says("rendering", "#state")
    assert state_of(daemon).tick > before.tick


FAINT = """
    const channels = (colour) => colour.match(/[\\d.]+/g).map(Number);
    const luminance = ([r, g, b]) => [r, g, b].map((c) => c / 255).map((c) => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4)
      .reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
    const ground = (e) => { for (; e; e = e.parentElement) { const c = channels(getComputedStyle(e).backgroundColor); if (c[3] !== 0) return c; } return [255, 255, 255]; };
    const found = [];
    for (const e of document.querySelectorAll('body *')) {
      const own = [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
      if (!own || !e.checkVisibility({checkVisibilityCSS: true}) || e.closest(':disabled, option, script')) continue;
      const style = getComputedStyle(e), [a, b] = [luminance(channels(style.color)), luminance(ground(e))];
      const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), size = parseFloat(style.fontSize);
      if (ratio < (size >= 24 || size >= 18.66 && style.fontWeight >= 700 ? 3 : 4.5)) found.push(`${ratio.toFixed(2)}: ${e.textContent.trim().slice(0, 40)}`);
    }
    return found;"""


#: Tables with a column that a screen reader has no name for.
UNNAMED_COLUMNS = "return [...document.querySelectorAll('th')].filter((e) => !e.textContent.trim()).map((e) => e.closest('table').textContent)"


def test_every_view_can_be_reached_by_keys_and_has_names_for_all_controls(page: Page, daemon: Any) -> None:  # noqa: F811
    opened(page, daemon)
    page.driver.set_window_size(820, 1100)  # a tablet
    for number, view in enumerate(("now", "live", "scene", "identify", "objects", "turntable", "recordings", "experiment", "poses", "log")):
        page.run("dispatchEvent(new KeyboardEvent('keydown', {key: arguments[0], altKey: true, bubbles: true}))", str((number + 1) % 10))
        page.wait(lambda: page.shows(f".view.{view}"))
        page.settle()
        nameless = page.run("""return [...document.querySelectorAll('button, input, select, canvas, iframe, a')].filter((e) =>
            !(e.textContent.trim() || e.getAttribute('aria-label') || e.title || e.closest('label')?.textContent.trim())).map((e) => e.outerHTML)""")
        assert nameless == []
        assert page.run(UNNAMED_COLUMNS) == []
        # Nothing is wider than the page, on a tablet neither.
        assert page.run("return document.documentElement.scrollWidth <= innerWidth + 1"), view
    page.driver.set_window_size(*SIZE)
    page.click("◐", "header")
    assert page.run("return document.documentElement.dataset.theme") == "dark"
    # All that is written can be read, in both themes: WCAG's contrast of 4.5, 3 if it is large.
    for _ in range(2):
        for view in ("now", "scene", "identify", "objects", "turntable", "recordings", "experiment", "log"):
            page.view(view)
            page.settle()
            assert page.run(FAINT) == [], view
        page.click("◐", "header")
    assert page.problems() == []
