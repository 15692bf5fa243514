"""Runs the suite's programs as a user would, and says what a refusal must look like."""
import pathlib
import shutil
import subprocess
import tempfile
import unittest

from support import workspace

BAD_DATA = 1
BAD_ARGUMENTS = 2
# Long enough for any replay under a debugger or on a busy machine; a program that hangs fails.
TIMEOUT_S = 300


def run(package, name, *arguments, **options):
    command = [workspace.program(package, name)] + [str(a) for a in arguments]
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          timeout=TIMEOUT_S, check=False, **options)


def replay(bag, config, output, *more, estimator="gp_localize"):
    return run(estimator, f"{estimator}_replay", "--bag", bag, "--config", config, "--output", output, *more)


class ProgramTest(unittest.TestCase):
    """A test with a scratch folder of its own."""

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="field_system_tests_"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.output = self.folder / "out"

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path

    def must(self, done):
        """The output of a program that has to succeed, without a word on standard error."""
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr, "")
        return done.stdout

    def assert_refused(self, done, *texts, code=BAD_DATA):
        """One line on standard error that holds all texts; nothing written, not even in part."""
        self.assertEqual(done.returncode, code, done.stderr or done.stdout)
        self.assertEqual(len(done.stderr.splitlines()), 1, f"not one line: {done.stderr!r}")
        for text in texts:
            self.assertIn(str(text), done.stderr)
        self.assertFalse(self.output.exists(), f"{self.output} was left behind")
        leftovers = [p.name for p in self.folder.rglob("*") if "partial" in p.name or "tmp" in p.name]
        self.assertEqual(leftovers, [])
