#!/usr/bin/env python3
"""Checks that docs/threads.md lists every thread and every lock, and that locks are the annotated ones.

    deploy/check_locks.py [--root FOLDER]

- every thread is named where it starts, and docs/threads.md has a row for each name;
- docs/threads.md has a row for each lock, with its file, in the table of its type, and no row of a lock that is gone;
- a lock guards something: a member names it (GUARDED_BY), or it is a SerialMutex, or it is listed in GUARDS_A_CHANNEL;
- no lock of the standard library outside hal/lock: clang's analysis does not see it;
- no std::function as a member next to a lock: it is a Callback, which is not called under one.

Exit status 1 if one of these is broken.
"""
import argparse
import pathlib
import re
import sys

TOPS = ("hal", "rt", "server", "client")
PAGE = "docs/threads.md"
OWN = "hal/lock/"
# Locks of the ends of a channel, whose other end needs none; clang cannot say that of a member.
GUARDS_A_CHANNEL = {"rt/loop/engine.h producers_", "server/telemetry/telemetry_hub.h latest_mutex_"}
# Files whose threads have no name, as only a short run of a command has them, or name themselves in another file.
UNNAMED = {"client/cli/fleet/on_rigs.cpp", "hal/turntable/driven_turntable.cpp"}

LOCK = re.compile(r"^( *)(?:mutable |static )?(Mutex|SerialMutex|SharedSerialMutex) (\w+)")
SCOPE = re.compile(r"^( *)(?:class|struct) (?:\w+\([^)]*\) )?(?:\w+::)*(\w+)(?: final)?(?: :[^:].*)?(?: \{.*)?$")
FUNCTION = re.compile(r"^( *)(?:\S.* )?(\w+)\(.*\{$")
STANDARD = re.compile(r"std::(?:(?:recursive_|timed_|shared_|shared_timed_|recursive_timed_)?mutex|lock_guard|unique_lock"
                      r"|scoped_lock|shared_lock|condition_variable(?:_any)?)\b")
FUNCTION_MEMBER = re.compile(r"^ +(?:mutable |const )*std::function<.*> \w+(?: = .*)?;|= std::function<")
STARTS_THREAD = re.compile(r"std::j?thread\(\[|\bthread_?\(\[|: thread\(\[")
THREAD_NAME = re.compile(r'(?:pthread_setname_np\(|\bWaitQueue \w+\{|\bStopListener::Parts\{)[^;"]*"([^"]+)"')
LONGEST_NAME = 15
ROW = re.compile(r"^\| `([^`]+)` \| `([^`]+)` \|")
THREAD_ROW = re.compile(r"^\| `([^`]+)` \| [^`]")


def sources(root):
    for top in TOPS:
        for path in sorted((root / top).rglob("*")):
            name = path.relative_to(root).as_posix()
            if path.suffix in (".h", ".cpp") and not name.startswith(OWN):
                yield name, path.read_text(encoding="utf-8").splitlines()


def enclosing(lines, number, indent):
    """The class, or the function, that a declaration is in."""
    for line in reversed(lines[:number]):
        for pattern in (SCOPE, FUNCTION):
            found = pattern.match(line)
            if found and len(found.group(1)) < indent and not line.rstrip().endswith(";"):
                return found.group(2)
    return ""


def locks_of(lines):
    """[(type, member, "Class::member")]."""
    found = []
    for number, line in enumerate(lines):
        declared = LOCK.match(line)
        if declared:
            scope = enclosing(lines, number, len(declared.group(1)))
            found.append((declared.group(2), declared.group(3), f"{scope}::{declared.group(3)}"))
    return found


def page_of(root):
    """({thread names}, {(lock, file): whether it is listed as a serial one})."""
    path = root / PAGE
    threads, locks, part = set(), {}, ""
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else []:
        if line.startswith("## "):
            part = line
        lock, thread = ROW.match(line), THREAD_ROW.match(line)
        if lock:
            locks[lock.groups()] = "follow one another" in part
        elif thread and "Threads" in part:
            threads.add(thread.group(1))
    return threads, locks


def problems(root):
    threads_listed, locks_listed = page_of(root)
    locks_seen, texts = set(), dict(sources(root))
    for name, lines in texts.items():
        text = "\n".join(lines)
        stem = name.rpartition(".")[0]
        pair = "\n".join(line for ending in (".h", ".cpp") for line in texts.get(stem + ending, []))
        for thread in THREAD_NAME.findall(text):
            if thread not in threads_listed:
                yield f"{name}: the thread '{thread}' is not in {PAGE}"
            if len(thread) > LONGEST_NAME:
                yield f"{name}: the system takes no name of a thread as long as '{thread}'"
        if name not in UNNAMED and STARTS_THREAD.search(text) and "pthread_setname_np" not in pair:
            yield f"{name}: a thread has no name: pthread_setname_np() where it begins, and a row in {PAGE}"
        for number, line in enumerate(lines, 1):
            if STANDARD.search(line):
                yield f"{name}:{number}: a lock that clang does not check: use those of hal/lock/mutex.h"
        locks = locks_of(lines)
        for number, line in enumerate(lines, 1):
            if locks and FUNCTION_MEMBER.search(line):
                yield f"{name}:{number}: a std::function where there is a lock: use Callback (hal/lock/callback.h)"
        for kind, member, lock in locks:
            locks_seen.add((lock, name))
            is_serial = kind != "Mutex"
            if (lock, name) not in locks_listed:
                yield f"{name}: the lock `{lock}` is not in {PAGE}"
            elif locks_listed[lock, name] != is_serial:
                yield f"{name}: the lock `{lock}` is in the wrong table of {PAGE}: it is a {kind}"
            guards = re.search(rf"GUARDED_BY\({member}\)", text)
            if not guards and not is_serial and f"{name} {member}" not in GUARDS_A_CHANNEL:
                yield f"{name}: no member is GUARDED_BY({member})"
    for lock, name in sorted(locks_listed.keys() - locks_seen):
        yield f"{PAGE}: there is no lock `{lock}` in {name}"
    names = {name for lines in texts.values() for name in THREAD_NAME.findall("\n".join(lines))}
    for thread in sorted(threads_listed - names):
        yield f"{PAGE}: no thread is named '{thread}'"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent.parent)
    options = parser.parse_args()
    found = list(problems(options.root))
    for problem in found:
        print(f"check_locks.py: {problem}", file=sys.stderr)
    if not found:
        print("check_locks.py: all threads and locks are listed")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
