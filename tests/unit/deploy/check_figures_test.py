"""Whether deploy/check_figures.py notices what it is there for."""

import contextlib
import io
import json
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "deploy"))
sys.dont_write_bytecode = True
import check_figures  # noqa: E402

DEFINITIONS = """
held = { figure = "rig/held_error", case = { device = "one" }, not = { object = "wood" }, show = "range %+.1f", factor = 100 }
worst = { figure = "rig/held_error", case = { object = ["sponge", "foam"] }, show = "max %.2f" }
"""
TEXT = """
| figure | measured | to compare |
|---|---|---|
| held, 2 N | −1.2 … +0.1<!--held--> %, at most 0.00<!--worst-->; 5.61 N | goal 5 % |
"""
SOURCE = 'report.add({"held_error", {{"device", device}, {"object", object}}});'


def record(device, object_name, value, run="rig"):
    return {"run": run, "figure": "held_error", "case": {"device": device, "object": object_name}, "value": value}


RECORDS = [
    record("one", "sponge", -0.0118),
    record("one", "foam", 0.0006),
    record("one", "wood", 0.9),
    record("two", "sponge", -0.5),
    record("one", "sponge", 0.7, run="explore"),
]


class Checked(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.write("README.md", TEXT)
        self.write("figures.toml", DEFINITIONS)
        self.write("study.cpp", SOURCE)
        self.measured(RECORDS)

    def write(self, name, text):
        (self.folder / name).write_text(text, encoding="utf-8")

    def measured(self, records):
        self.write("figures.jsonl", "".join(json.dumps(each) + "\n" for each in records))

    def check(self, *options):
        """(status, what it printed)"""
        printed = io.StringIO()
        arguments = [str(self.folder / "README.md"), *options]
        arguments += ["--definitions", str(self.folder / "figures.toml"), "--sources", str(self.folder)]
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
            status = check_figures.main(arguments)
        return status, printed.getvalue()

    def against_figures(self, *options):
        return self.check("--figures", str(self.folder / "figures.jsonl"), *options)

    def complains(self, outcome, words):
        status, printed = outcome
        self.assertEqual(status, 1, printed)
        self.assertIn(words, printed)

    def passes(self, outcome):
        self.assertEqual(outcome[0], 0, outcome[1])


class Static(Checked):
    def test_takes_what_fits_together_and_counts_the_unmarked(self):
        status, printed = self.check("--static")
        self.assertEqual(status, 0, printed)
        self.assertIn("README.md:2: 3 numbers marked, 1 not", printed)

    def test_wants_a_definition(self):
        self.write("README.md", TEXT + "3<!--nowhere-->\n")
        self.complains(self.check("--static"), "nothing defines the mark 'nowhere'")

    def test_wants_a_number_before_the_mark(self):
        self.write("README.md", TEXT + "many <!--worst-->\n")
        self.complains(self.check("--static"), "README.md:5: there is no number directly before the mark 'worst'")

    def test_wants_both_ends_of_a_range(self):
        self.write("README.md", TEXT.replace("−1.2 … ", ""))
        self.complains(self.check("--static"), "'held' is a range")

    def test_wants_the_digits_that_are_printed(self):
        self.write("README.md", TEXT.replace("0.00<!--worst-->", "0.0<!--worst-->"))
        self.complains(self.check("--static"), "0.0 is not of the form %.2f of 'worst'")

    def test_wants_a_figure_that_a_study_names(self):
        self.write("study.cpp", SOURCE.replace("held_error", "held_stiffness"))
        self.complains(self.check("--static"), "no study or benchmark names a figure 'held_error'")

    def test_wants_a_condition_that_a_study_names(self):
        self.write("study.cpp", SOURCE.replace('"device"', "kDevice"))
        self.complains(self.check("--static"), "no study or benchmark names a condition 'device'")

    def test_wants_every_definition_used(self):
        self.write("README.md", TEXT.replace("<!--worst-->", ""))
        self.complains(self.check("--static"), "no text has the mark 'worst'")

    def test_names_what_is_malformed(self):
        for change, words in (
            (('"max %.2f"', '"most %.2f"'), "worst: show must be like"),
            (('"max %.2f"', '"max %s"'), "worst: show must be like"),
            (("rig/held_error", "held_error"), "held: figure must be RUN/FIGURE"),
            (("factor", "faktor"), "held: no key 'faktor'"),
        ):
            with self.subTest(change):
                self.write("figures.toml", DEFINITIONS.replace(*change))
                self.complains(self.check("--static"), words)


PAGE = """# A page

What it is.

| cause | force |
|---|---|
| late by 5 ms | 0.1<!--held--> N |
| † slow | 0.2 N |

- held within 3 %, `f 7 N`
  and 8.5 mm
"""


class Explained(Checked):
    def complaints(self, page, given=()):
        self.write("page.md", page)
        found = []
        check_figures.check_explained([self.folder / "page.md"], {"page.md": list(given)}, found)
        return found

    def test_wants_a_mark_a_dagger_or_a_given_number(self):
        self.assertEqual([each.split(" has ")[0] for each in self.complaints(PAGE)], ["page.md:10: 3 %", "page.md:10: 8.5 mm"])
        self.assertEqual(self.complaints(PAGE, ["3 %", "8.5 mm"]), [])
        self.assertEqual(self.complaints(PAGE.replace("- held", "- † held")), [])
        self.assertEqual(self.complaints(PAGE.replace("What it is.", "† Measured in spring.")), [])
        self.assertEqual(len(self.complaints(PAGE.replace("What it is.", "†: measured in spring."))), 2)

    def test_wants_no_given_number_that_is_gone(self):
        self.assertIn("page.md has no '4 s'", self.complaints(PAGE, ["3 %", "8.5 mm", "4 s"])[0])


class AgainstFigures(Checked):
    def test_takes_the_measured_numbers_of_the_run_and_cases_named(self):
        self.passes(self.against_figures())

    def test_wants_the_measured_number(self):
        for wrong in (("−1.2", "−1.3"), ("−1.2", "+1.2"), ("+0.1", "+0.2"), ("0.00<", "0.01<")):
            with self.subTest(wrong):
                self.write("README.md", TEXT.replace(*wrong))
                self.complains(self.against_figures(), "measured")

    def test_takes_a_minus_and_thousands_as_they_are_set(self):
        self.write("figures.toml", 'sum = { figure = "rig/held_error", show = "sum %d" }\n')
        self.write("README.md", "−28 992<!--sum--> steps\n")
        self.measured([record("one", "sponge", -28000), record("one", "foam", -992)])
        self.passes(self.against_figures())

    def test_knows_no_negative_zero(self):
        self.measured([record("one", "sponge", -0.0004), record("one", "foam", 0.0)])
        self.write("README.md", TEXT.replace("−1.2 … +0.1", "+0.0 … +0.0"))
        self.passes(self.against_figures())

    def test_passes_over_no_case_that_gave_nothing(self):
        self.measured([*RECORDS, record("one", "rubber", None)])
        self.complains(self.against_figures(), "1 of 3 records of rig/held_error (device=one, object≠wood) have no value")

    def test_takes_what_differs_by_no_more_than_the_tolerance(self):
        self.write("figures.toml", 'count = { figure = "rig/held_error", show = "only %.0f", tolerance = 0.03 }\n')
        self.write("README.md", "2 463<!--count--> instructions\n")
        for measured, status in ((2463, 0), (2395, 0), (2538, 0), (2380, 1), (2550, 1)):
            with self.subTest(measured):
                self.measured([record("one", "sponge", measured)])
                self.assertEqual(self.against_figures()[0], status)

    def test_wants_every_case_that_is_listed(self):
        self.measured([each for each in RECORDS if each["case"]["object"] != "foam"])
        self.complains(self.against_figures(), "has object foam")

    def test_wants_a_value_at_all(self):
        self.measured([])
        self.complains(self.against_figures(), "no value of rig/held_error")

    def test_wants_one_record_where_one_is_meant(self):
        self.write("figures.toml", DEFINITIONS.replace('"max', '"only'))
        self.complains(self.against_figures(), "3 values of rig/held_error")

    def test_counts_what_is_within_its_goal(self):
        self.write("figures.toml", 'held = { figure = "rig/held_error", show = "within %d" }\n')
        self.write("README.md", "2<!--held--> of 3\n")
        goals = ((0.1, 0.2), (0.2, 0.2), (0.3, 0.2))
        self.measured([{**record("one", "foam", value), "goal": goal} for value, goal in goals])
        self.passes(self.against_figures())

    def test_only_reports_what_is_the_machine_s(self):
        self.write("figures.toml", DEFINITIONS.replace('"max %.2f"', '"max %.2f", machine = true'))
        self.write("README.md", TEXT.replace("0.00<", "0.07<"))
        status, printed = self.against_figures()
        self.assertEqual(status, 0, printed)
        self.assertIn("differs, as it may: README.md:4: 'worst' says 0.07, measured 0.00", printed)

    def test_holds_a_quick_run_to_what_it_measures_alike(self):
        self.write("README.md", TEXT.replace("−1.2", "−1.3"))
        self.passes(self.against_figures("--quick"))
        self.write("figures.toml", DEFINITIONS.replace("factor = 100", "factor = 100, in_quick = true"))
        self.complains(self.against_figures("--quick"), "says -1.3 … +0.1, measured -1.2 … +0.1")

    def test_wants_figures_of_a_quick_run_too(self):
        self.measured([each for each in RECORDS if each["case"]["device"] == "two"])
        self.complains(self.against_figures("--quick"), "'held': no value")
        self.write("figures.toml", DEFINITIONS.replace("factor = 100", "factor = 100, only_full = true"))
        self.passes(self.against_figures("--quick"))
        self.complains(self.against_figures(), "'held': no value")

    def test_writes_what_was_measured(self):
        self.write("README.md", TEXT.replace("−1.2 … +0.1", "0.0 … 0.0").replace("0.00<", "9.99<"))
        self.passes(self.against_figures("--write"))
        self.assertEqual((self.folder / "README.md").read_text(encoding="utf-8"), TEXT)


    def test_writes_of_a_quick_run_what_it_measures_alike(self):
        wrong = TEXT.replace("−1.2 … +0.1", "0.0 … 0.0").replace("0.00<", "9.99<")
        self.write("README.md", wrong)
        self.write("figures.toml", DEFINITIONS.replace("factor = 100", "factor = 100, in_quick = true"))
        self.passes(self.against_figures("--write", "--quick"))
        self.assertEqual(
            (self.folder / "README.md").read_text(encoding="utf-8"), wrong.replace("0.0 … 0.0", "−1.2 … +0.1")
        )

    def test_excuses_recordings_that_are_not_at_hand(self):
        self.measured([])
        self.write("figures.toml", DEFINITIONS.replace(" }\n", ", recordings = true }\n"))
        self.complains(self.against_figures(), "no value")
        self.passes(self.against_figures("--without-recordings"))


class CommandLine(Checked):
    def test_tells_a_file_that_is_not_there(self):
        status, printed = self.check("--figures", str(self.folder / "none.jsonl"))
        self.assertEqual(status, 2)
        self.assertIn("none.jsonl", printed)


if __name__ == "__main__":
    unittest.main()
