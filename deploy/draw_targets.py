#!/usr/bin/env python3
"""The targets of the product and what each uses, as CMake has them: the picture of docs/architecture.md.

    deploy/draw_targets.py            draws docs/pictures/targets.svg (needs graphviz: deploy/install_packages.sh drawing)
    deploy/draw_targets.py --check    compares the picture with the build; exit status 1 if they differ

An arrow that others imply is left out: what a target uses, its users may use.
"""
import argparse
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PICTURE = ROOT / "docs/pictures/targets.svg"
LAYERS = {"proto": "#f4f1e8", "hal": "#e8f0f8", "rt": "#fbe9e1", "server": "#eaf4ea", "client": "#f1eaf6"}
CONTRACT = "hapticd_proto"  # generated, so that it is not a hapticd_library()
LIBRARY = re.compile(r"^hapticd_library\((\w+)\s([^()]*)\)", re.MULTILINE)
COMMENT = re.compile(r"#[^\n]*")
DRAWN = re.compile(r"<title>(\w+)&#45;&gt;(\w+)</title>")


def read_targets():
    """Target → its layer and the targets that it links to."""
    targets = {CONTRACT: ("proto", set())}
    for layer in LAYERS:
        for path in sorted((ROOT / layer).rglob("CMakeLists.txt")):
            for name, arguments in LIBRARY.findall(COMMENT.sub("", path.read_text(encoding="utf-8"))):
                words = arguments.split()
                links = words[words.index("LINK") + 1:] if "LINK" in words else []
                targets[name] = (layer, {link for link in links if link.startswith("hapticd_")})
    return targets


def reach(uses, target):
    """All that a target uses, directly or through others."""
    found = set()
    waiting = list(uses[target])
    while waiting:
        used = waiting.pop()
        if used not in found:
            found.add(used)
            waiting += uses[used]
    return found


def needed_arrows(targets):
    uses = {name: links for name, (_, links) in targets.items()}
    return {(name, used) for name, links in uses.items() for used in links
            if not any(used in reach(uses, other) for other in links - {used})}


def description(targets, arrows):
    """The picture in the language of graphviz."""
    lines = ["digraph targets {",
             'fontname="Helvetica"; nodesep=0.12; ranksep=0.35;',
             'node [shape=box, style="filled,rounded", fillcolor=white, color="#888888", fontname="Helvetica", '
             'fontsize=11, height=0.26, margin="0.08,0.03"];',
             'edge [color="#999999", arrowsize=0.5];']
    for layer, colour in LAYERS.items():
        lines.append(f'subgraph cluster_{layer} {{ label="{layer}/"; labeljust=l; style="filled,rounded"; color="{colour}";')
        lines += [f'{name} [label="{name.removeprefix("hapticd_")}"];'
                  for name, (its, _) in sorted(targets.items()) if its == layer]
        lines.append("}")
    return "\n".join([*lines, *(f"{user} -> {used};" for user, used in sorted(arrows)), "}"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="compare only")
    check = parser.parse_args().check
    targets = read_targets()
    arrows = needed_arrows(targets)
    if not check:
        picture = subprocess.run(["dot", "-Tsvg"], input=description(targets, arrows), stdout=subprocess.PIPE,
                                 text=True, check=True)
        PICTURE.write_text(picture.stdout, encoding="utf-8")
        return 0
    drawn = set(DRAWN.findall(PICTURE.read_text(encoding="utf-8")))
    for what, wrong in (("is not drawn", arrows - drawn), ("is drawn, but not in the build", drawn - arrows)):
        for user, used in sorted(wrong):
            print(f"{PICTURE.relative_to(ROOT)}: {user} -> {used} {what}; run deploy/draw_targets.py")
    return 0 if drawn == arrows else 1


if __name__ == "__main__":
    sys.exit(main())
