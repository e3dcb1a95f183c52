"""Whether deploy/check_locks.py notices threads and locks that docs/threads.md lacks; and that here it lacks none."""

import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "deploy"))
sys.dont_write_bytecode = True
import check_locks  # noqa: E402

PAGE = """
## Threads of the daemon

| name | what it does | priority | may wait for |
|---|---|---|---|
| `worker` | works | ordinary | nothing |

## Locks that are held briefly

| lock | in | guards | under it |
|---|---|---|---|
| `Desk::mutex_` | `server/desk.h` | all of it | |

## Locks that make calls follow one another

| lock | in | what | under it |
|---|---|---|---|
| `Desk::turn_` | `server/desk.h` | works | |
"""
DESK = """
class Desk final : public Base {
  void run() { pthread_setname_np(pthread_self(), "worker"); }
  mutable Mutex mutex_;
  SerialMutex turn_;
  int x_ GUARDED_BY(mutex_) = 0;
  std::thread thread_([this] { run(); });
};
"""


class Locks(unittest.TestCase):
    def problems(self, desk=DESK, page=PAGE):
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            for name, text in (("server/desk.h", desk), ("docs/threads.md", page)):
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text, encoding="utf-8")
            return list(check_locks.problems(root))

    def only(self, words, **files):
        found = self.problems(**files)
        self.assertEqual(len(found), 1, found)
        self.assertIn(words, found[0])

    def test_a_page_that_lists_all_is_right(self):
        self.assertEqual(self.problems(), [])

    def test_a_thread_that_is_not_listed_is_named(self):
        self.only("the thread 'other' is not in", desk=DESK + 'pthread_setname_np(pthread_self(), "other");\n')
        self.only("the thread 'clears' is not in", desk=DESK + 'WaitQueue clears_{"clears"};\n')

    def test_a_thread_without_a_name_is_named(self):
        found = self.problems(desk=DESK.replace("pthread_setname_np(pthread_self(), \"worker\");", ""))
        self.assertIn("server/desk.h: a thread has no name", found[0])
        self.assertIn("no thread is named 'worker'", found[1])

    def test_a_lock_that_is_not_listed_is_named(self):
        desk = DESK.replace("SerialMutex turn_;", "SerialMutex turn_;\n  SerialMutex more_;")
        self.only("the lock `Desk::more_` is not in", desk=desk)

    def test_a_lock_that_is_gone_is_named(self):
        self.only("there is no lock `Desk::turn_`", desk=DESK.replace("  SerialMutex turn_;\n", ""))

    def test_a_lock_of_another_type_is_named(self):
        self.only("is in the wrong table", desk=DESK.replace("mutable Mutex", "mutable SerialMutex"))

    def test_a_lock_that_guards_nothing_is_named(self):
        self.only("no member is GUARDED_BY(mutex_)", desk=DESK.replace(" GUARDED_BY(mutex_)", ""))

    def test_a_lock_of_the_standard_library_is_named(self):
        for lock in ("std::mutex a_;", "const std::lock_guard lock(a_);", "std::condition_variable_any b_;"):
            self.only("a lock that clang does not check", desk=DESK + lock + "\n")

    def test_a_function_that_could_be_called_under_a_lock_is_named(self):
        self.only("use Callback", desk=DESK.replace("  int x_", "  std::function<void()> call_;\n  int x_"))
        self.only("use Callback", desk=DESK.replace("  int x_", "  using Done = std::function<void()>;\n  int x_"))

    def test_the_project_itself(self):
        self.assertEqual(list(check_locks.problems(ROOT)), [])
        threads, locks = check_locks.page_of(ROOT)
        self.assertGreater(len(threads), 25)
        self.assertGreater(len(locks), 50)


if __name__ == "__main__":
    unittest.main()
