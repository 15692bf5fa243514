#!/usr/bin/python3
"""Pages that are written from the code are those of this code, and no link leads nowhere."""
import re
import unittest

from support import workspace
from support.programs import run
from support.runner import main

NODES = ("gp_localize", "vector_field_slam", "gmrf_slap")


def pages():
    root = workspace.source_root()
    made = {"build", "devel", "install", "log", "out"}
    return [page for page in root.rglob("*.md") if page.relative_to(root).parts[0] not in made]


class Documentation(unittest.TestCase):
    def test_parameter_pages_are_current(self):
        for node in NODES:
            with self.subTest(node):
                page = (workspace.source_root() / "docs" / f"parameters_{node}.md").read_text()
                table = run(node, f"{node}_replay", "--print-markdown").stdout
                self.assertIn("| `odom_alpha1` |", table)
                self.assertTrue(page.endswith(table.strip() + "\n"), "run tools/docs.sh")

    def test_links_lead_somewhere(self):
        links = 0
        for page in pages():
            for target in re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", page.read_text()):
                if "://" in target:
                    continue
                links += 1
                with self.subTest(f"{page.name}: {target}"):
                    self.assertTrue((page.parent / target).exists())
        self.assertGreater(links, 50)

    def test_the_readme_begins_with_what_a_newcomer_needs(self):
        text = (workspace.source_root() / "README.md").read_text()
        first = text.split("\n## ")[0]
        self.assertLessEqual(len(first.splitlines()), 40)
        for wanted in ("![", "tools/demo.sh", "tools/test.sh", "| package |"):
            self.assertIn(wanted, first)


if __name__ == "__main__":
    main("documentation")
