"""Runs the unittest cases of a script, with JUnit results that also tell what was skipped and why.

rosunit's own runner writes no <skipped>: a test that did not run would be counted as passed.
"""
import pathlib
import sys
import time
import unittest
import xml.etree.ElementTree as ElementTree

XML_FLAG = "--gtest_output=xml:"


class Result(unittest.TextTestResult):
    """Notes the outcome of each case, those of failed set-ups included."""

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        self.cases = []  # (id, seconds, tag or None, text)
        self._started = time.monotonic()
        self._failed_subtest = False

    def startTest(self, test):
        super().startTest(test)
        self._started = time.monotonic()
        self._failed_subtest = False

    def _note(self, test, tag=None, text=""):
        self.cases.append((test.id(), time.monotonic() - self._started, tag, text))

    def addSuccess(self, test):
        super().addSuccess(test)
        if not self._failed_subtest:
            self._note(test)

    def addError(self, test, err):
        super().addError(test, err)
        self._note(test, "error", self.errors[-1][1])

    def addFailure(self, test, err):
        super().addFailure(test, err)
        self._note(test, "failure", self.failures[-1][1])

    def addSkip(self, test, reason):
        super().addSkip(test, reason)
        self._note(test, "skipped", reason)

    def addSubTest(self, test, subtest, err):
        super().addSubTest(test, subtest, err)
        if err is not None:
            self._failed_subtest = True
            self._note(subtest, "failure", "".join(str(part) for part in err[:2]))

    def write(self, path, name):
        suite = ElementTree.Element("testsuite", name=name, tests=str(len(self.cases)))
        for tag, plural in (("failure", "failures"), ("error", "errors"), ("skipped", "skipped")):
            suite.set(plural, str(sum(case[2] == tag for case in self.cases)))
        suite.set("time", f"{sum(case[1] for case in self.cases):.3f}")
        for identifier, seconds, tag, text in self.cases:
            classname, _, method = identifier.rpartition(".")
            case = ElementTree.SubElement(suite, "testcase", classname=classname, name=method,
                                          time=f"{seconds:.3f}")
            if tag:
                ElementTree.SubElement(case, tag, type=tag, message=text[-2000:]).text = text
        pathlib.Path(path).parent.mkdir(parents=True, exist_ok=True)
        ElementTree.ElementTree(suite).write(path, encoding="utf-8", xml_declaration=True)


def main(name):
    """Runs all cases of __main__ (or those named on the command line); exits 1 if one fails."""
    names = [a for a in sys.argv[1:] if not a.startswith("-") and ":=" not in a]
    module = sys.modules["__main__"]
    loader = unittest.defaultTestLoader
    suite = loader.loadTestsFromNames(names, module) if names else loader.loadTestsFromModule(module)
    runner = unittest.TextTestRunner(stream=sys.stdout, verbosity=2, resultclass=Result)
    result = runner.run(suite)
    for argument in sys.argv[1:]:
        if argument.startswith(XML_FLAG):
            result.write(argument[len(XML_FLAG):], name)
    sys.exit(0 if result.wasSuccessful() and result.cases else 1)
