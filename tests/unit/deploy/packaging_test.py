#!/usr/bin/env python3
"""The packages are built with packages of the one list, and with all that the configuration of the build asks for."""
import pathlib
import re
import subprocess
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
# Packages of the tests only, or needed before a package is built.
NOT_NEEDED = {"g++", "ccache", "lld", "libgtest-dev", "libbenchmark-dev", "libceres-dev"}
# Helpers of the build of packages.
HELPERS = {"debhelper-compat", "dh-sequence-installsysusers", "dh-sequence-python3"}


class Packaging(unittest.TestCase):
    def test_build_dependencies_are_those_of_the_list(self):
        listed = set(subprocess.run(["bash", ROOT / "deploy/install_packages.sh", "--list", "build", "libraries"],
                                    check=True, capture_output=True, text=True).stdout.split())
        control = (ROOT / "deploy/debian/control").read_text(encoding="utf-8")
        field = re.search(r"^Build-Depends:(.*?)^\S|^Build-Depends:(.*?)\n\n", control, re.DOTALL | re.MULTILINE)
        named = {re.sub(r"\(.*?\)", "", name).strip() for name in (field[1] or field[2]).split(",")}
        self.assertEqual(named - HELPERS, listed - NOT_NEEDED)

    def test_the_packaged_configuration_names_no_hardware(self):
        rig = (ROOT / "deploy/service/rig.toml").read_text(encoding="utf-8")
        self.assertRegex(rig, r'(?m)^kind = "sim"')
        self.assertNotRegex(rig, r"(?m)^device = ")


if __name__ == "__main__":
    unittest.main()
