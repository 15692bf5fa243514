#!/usr/bin/python3
"""Counts the test cases of all result files below a build directory: 'N passed, N failed, N skipped'."""
import pathlib
import sys
import xml.etree.ElementTree as ElementTree


def main(build_dir):
    passed = failed = skipped = 0
    for path in pathlib.Path(build_dir).glob("*/test_results/**/*.xml"):
        try:
            cases = list(ElementTree.parse(path).getroot().iter("testcase"))
        except ElementTree.ParseError:
            print(f"{path}: not readable, counted as failed", file=sys.stderr)
            failed += 1
            continue
        for case in cases:
            tags = {child.tag for child in case}
            if tags & {"failure", "error"}:
                failed += 1
            elif "skipped" in tags or case.get("status") == "notrun" or case.get("result") == "skipped":
                skipped += 1
            else:
                passed += 1
    print(f"{passed} passed, {failed} failed, {skipped} skipped")
    return 1 if failed or not passed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
