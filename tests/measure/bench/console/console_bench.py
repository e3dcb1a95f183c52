#!/usr/bin/env python3
"""What the console costs, measured in a headless browser: a line of JSON for each figure.

    console_bench.py --binaries DIR --out FILE [--quick] [--heap-s S]

A line: {"figure", "case", "value", "unit", "goal", "source", "failed"}. Called by hapticd_bench console.
"""
from __future__ import annotations

import argparse
import asyncio
import base64
import json
import os
import signal
import statistics
import struct
import sys
import tempfile
import time
from multiprocessing import Process
from pathlib import Path
from typing import Any, Callable

ROOT = Path(__file__).resolve().parents[4]
sys.path.insert(0, str(ROOT / "tests" / "python"))

VIEWS = "now live scene identify objects turntable recordings experiment poses log".split()
# What the view Live takes.
COLUMNS = ["time_ns", "deformation_displacement_mm", "control_hand_force_n", "contact_reaction_force_n", "target_stiffness_n_per_mm",
           "control_commanded_force_n", "motion_velocity_mm_per_s", "guard_authority", "timing_wakeup_ns"]  # fmt: skip
TABS = 16


class Bench:
    def __init__(self, out: Path, quick: bool) -> None:
        self.out = out.open("w", encoding="utf-8")
        self.quick = quick

    def add(self, figure: str, value: Any, unit: str, goal: Any = None, case: dict[str, Any] = {}, source: str = "", failed: str = "") -> None:  # noqa: B006
        line = {"figure": figure, "case": case, "value": value, "unit": unit, "goal": goal, "source": source, "failed": failed}
        self.out.write(json.dumps(line) + "\n")
        self.out.flush()
        print(f"{figure} {case or ''}: {failed or value} {unit}", flush=True)

    def part(self, figures: list[tuple[str, str, float]], run: Callable[[], None]) -> None:
        try:
            run()
        except Exception as error:  # a figure that failed is a record, too
            for name, unit, goal in figures:
                self.add(name, None, unit, goal, failed=f"{type(error).__name__}: {error}"[:300])


def metrics(driver: Any) -> dict[str, float]:
    return {one["name"]: one["value"] for one in driver.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]}


def heap_mb(driver: Any) -> float:
    driver.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
    return metrics(driver)["JSHeapUsedSize"] / 1e6


def cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def tab(port: int, cookie: str, seconds: float) -> None:
    """What one visible page asks of the daemon: rows as fast as they come, the state twice a second."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    key = base64.b64encode(os.urandom(16)).decode()
    writer.write(f"GET /live HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                 f"Sec-WebSocket-Key: {key}\r\nOrigin: http://127.0.0.1:{port}\r\nCookie: {cookie}\r\n\r\n".encode())  # fmt: skip
    await reader.readuntil(b"\r\n\r\n")

    def send(text: str) -> None:
        payload = text.encode()
        head = bytes([0x81]) + (bytes([0x80 | len(payload)]) if len(payload) < 126 else bytes([0xFE]) + struct.pack(">H", len(payload)))
        writer.write(head + bytes(4) + payload)  # a mask of zeros

    async def ask_state() -> None:
        ask_reader, ask_writer = await asyncio.open_connection("127.0.0.1", port)
        body = b'{"without_histograms":true}'
        request = (f"POST /rpc/hapticd.v1.RigService/GetRigState HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Type: application/json\r\nX-Hapticd: 1\r\n"
                   f"Cookie: {cookie}\r\nContent-Length: {len(body)}\r\n\r\n").encode() + body  # fmt: skip
        while True:
            ask_writer.write(request)
            head = await ask_reader.readuntil(b"\r\n\r\n")
            length = int(head.lower().split(b"content-length:")[1].split(b"\r\n")[0])
            await ask_reader.readexactly(length)
            await asyncio.sleep(0.5)

    send(json.dumps({"telemetry": 1, "columns": COLUMNS, "credits": 2}))
    asking = asyncio.create_task(ask_state())
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        head = await reader.readexactly(2)
        length = head[1] & 127
        if length == 126:
            length = struct.unpack(">H", await reader.readexactly(2))[0]
        elif length == 127:
            length = struct.unpack(">Q", await reader.readexactly(8))[0]
        await reader.readexactly(length)
        if head[0] & 15 == 2:
            send('{"credit":1,"n":1}')
    asking.cancel()
    writer.close()


def tabs(port: int, cookie: str, seconds: float) -> None:
    async def run() -> None:
        await asyncio.gather(*(tab(port, cookie, seconds) for _ in range(TABS)))

    asyncio.run(run())


def quantile_us(before: Any, after: Any, share: float) -> float:
    """Distribution of the ticks between two states."""
    counts = {bucket.up_to_us: bucket.count for bucket in after.buckets}
    for bucket in before.buckets:
        counts[bucket.up_to_us] = counts.get(bucket.up_to_us, 0) - bucket.count
    wanted, seen = share * sum(counts.values()), 0.0
    for up_to in sorted(counts):
        seen += counts[up_to]
        if seen >= wanted:
            return float(up_to)
    return float("nan")


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--binaries", required=True, type=Path)
    parser.add_argument("--out", required=True, type=Path)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--heap-s", type=float, default=120.0)
    options = parser.parse_args()
    os.environ["HAPTICD_BINARIES"] = str(options.binaries)
    sys.path.insert(0, str(options.binaries.parent / "python"))
    import hapticd
    from console_page import Page, Visitor, configuration, start_browser
    from daemon import Console, Daemon

    bench = Bench(options.out, options.quick)
    quick = options.quick
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        arguments = ("--scene", "tap_1d", "--model-store", ":memory:", *configuration(folder))
        daemon = Daemon(folder, *arguments)
        console = Console(folder, f"unix:{folder}/d.sock")
        driver = start_browser(folder / "profile", "disable-gpu")
        page = Page(driver)
        try:
            with hapticd.connect(daemon.address) as rig:
                rig.set_hand_program({"kind": "press", "force_n": 3.0, "repetitions": -1, "hold_s": 0.5})
                page.open(rig.open_console().url)
            origin = f"http://127.0.0.1:{console.port}"

            def first_paint() -> None:
                times = []
                for _ in range(3 if quick else 11):
                    driver.get("about:blank")
                    driver.get(origin + "/")
                    times.append(page.wait(lambda: page.run("return performance.getEntriesByName('first-contentful-paint')[0]?.startTime")))
                bench.add("console_first_paint_ms", statistics.median(times), "ms", 300, source="median, from the browser's own clock")

            def size() -> None:
                for view in VIEWS:
                    page.view(view)
                total = page.run("return performance.getEntriesByType('resource').filter((e) => !e.name.includes('/rpc/')).reduce((s, e) => s + e.decodedBodySize, "
                                 "performance.getEntriesByType('navigation')[0].decodedBodySize)")  # fmt: skip
                bench.add("console_page_kb", total / 1000, "kB", 150, source="all views, as decoded")

            def frames() -> None:
                page.view("live")
                time.sleep(13)  # until the 10 s are full
                driver.execute_cdp_cmd("Performance.enable", {})
                before, first = metrics(driver), page.run("return {...liveStats, at: performance.now()}")
                time.sleep(5 if quick else 20)
                after, last = metrics(driver), page.run("return {...liveStats, at: performance.now()}")
                count = last["frames"] - first["frames"]
                case = {"traces": 8, "seconds_shown": 10, "rate_hz": 1000}
                bench.add("console_fps", 1000 * count / (last["at"] - first["at"]), "1/s", 55, case)
                bench.add("console_script_ms", 1000 * (after["ScriptDuration"] - before["ScriptDuration"]) / count, "ms", 4, case,
                          "all scripts of the page, by the clock, per frame: a busy machine makes it larger")  # fmt: skip
                bench.add("console_draw_ms", (last["scriptMs"] - first["scriptMs"]) / count, "ms", None, case, "by the clock, of the drawing alone")
                driver.execute_cdp_cmd("Performance.disable", {})

            def heap() -> None:
                driver.execute_cdp_cmd("Performance.enable", {})
                seconds = 10.0 if quick else options.heap_s
                before = heap_mb(driver)
                time.sleep(seconds)
                bench.add("console_heap_growth_mb", heap_mb(driver) - before, "MB", 5, {"seconds": seconds}, "the view Live, after collecting garbage")
                driver.execute_cdp_cmd("Performance.disable", {})

            def stop() -> None:
                page.view("now")
                times = []
                for _ in range(5 if quick else 60):
                    times.append(driver.execute_async_script(
                        "const done = arguments[0]; const api = await import('/api.js'); const begun = performance.now(); await api.stop(); "
                        "const took = performance.now() - begun; await api.rpc('SafetyService/Clear'); done(took);"))  # fmt: skip
                    time.sleep(0.05)
                times.sort()
                for share in (0.5, 0.95):
                    bench.add("console_stop_ms", times[int(share * (len(times) - 1))], "ms", 20, {"quantile": share},
                              "from the key to the answer, which names the tick after which the guard is latched")  # fmt: skip

            def many_tabs() -> None:
                visitor = Visitor(daemon, console)
                driver.get("about:blank")
                seconds, rounds = (3.0, 1) if quick else (10.0, 4)
                parts = {"daemon": daemon.process.pid, "console": console.process.pid}
                shares: dict[tuple[str, int], list[float]] = {(part, count): [] for part in parts for count in (0, TABS)}
                lates: dict[int, list[float]] = {0: [], TABS: []}

                def used_s() -> dict[str, float]:
                    return {part: cpu_s(pid) for part, pid in parts.items()}

                with hapticd.connect(daemon.address) as rig:
                    for _ in range(rounds):
                        for count in (0, TABS):
                            reading = Process(target=tabs, args=(visitor.port, visitor.cookie, seconds + 2)) if count else None
                            if reading:
                                reading.start()
                            time.sleep(1.0)
                            before, used, begun = rig.get_rig_state().loop.wakeup, used_s(), time.monotonic()
                            time.sleep(seconds)
                            took = time.monotonic() - begun
                            for part, now in used_s().items():
                                shares[part, count].append((now - used[part]) / took)
                            lates[count].append(quantile_us(before, rig.get_rig_state().loop.wakeup, 0.999))
                            if reading:
                                reading.join()
                                if reading.exitcode != 0:
                                    raise RuntimeError("the tabs could not read")
                for part in parts:
                    extra = statistics.median(shares[part, TABS]) - statistics.median(shares[part, 0])
                    bench.add("console_cpu_share", extra, "1", 0.05, {"tabs": TABS, "process": part}, "of one core, more than without")
                for count in (0, TABS):
                    bench.add("console_loop_late_p999_us", statistics.median(lates[count]), "us", None, {"tabs": count}, "median of the rounds")
                bench.add("console_loop_late_ratio", statistics.median(lates[TABS]) / statistics.median(lates[0]), "1", 1.1, {"tabs": TABS},
                          "99.9 % of the loop's lateness, over none in the same run")  # fmt: skip

            def away() -> None:
                nonlocal daemon
                driver.get(origin + "/")
                page.wait(lambda: not page.shows("body.away") and "…" not in page.text("#rig"))
                page.run("window.changes = []; new MutationObserver(() => changes.push([Date.now(), document.body.classList.contains('away')]))"
                         ".observe(document.body, {attributes: true})")  # fmt: skip
                daemon.process.send_signal(signal.SIGSTOP)
                begun = time.time()
                shown = page.wait(lambda: page.run("return changes.find(([, away]) => away)"))
                bench.add("console_away_shown_s", shown[0] / 1000 - begun, "s", 2, {"daemon": "frozen"})
                daemon.process.send_signal(signal.SIGCONT)
                page.wait(lambda: not page.shows("body.away"))
                page.run("changes.length = 0")
                daemon.end(signal.SIGKILL)
                begun = time.time()
                shown = page.wait(lambda: page.run("return changes.find(([, away]) => away)"))
                bench.add("console_away_shown_s", shown[0] / 1000 - begun, "s", 2, {"daemon": "killed"})
                begun = time.time()
                daemon = Daemon(folder, *arguments)
                back = page.wait(lambda: page.run("return changes.find(([, away], i) => i && !away)"))
                bench.add("console_back_s", back[0] / 1000 - begun, "s", 2, {}, "from the start of the next daemon")

            bench.part([("console_first_paint_ms", "ms", 300)], first_paint)
            bench.part([("console_page_kb", "kB", 150)], size)
            bench.part([("console_fps", "1/s", 55), ("console_script_ms", "ms", 4)], frames)
            bench.part([("console_heap_growth_mb", "MB", 5)], heap)
            bench.part([("console_stop_ms", "ms", 20)], stop)
            bench.part([("console_cpu_share", "1", 0.05), ("console_loop_late_ratio", "1", 1.1)], many_tabs)
            bench.part([("console_away_shown_s", "s", 2), ("console_back_s", "s", 2)], away)
        finally:
            driver.quit()
            console.end()
            daemon.end()
    return 0


if __name__ == "__main__":
    sys.exit(main())
