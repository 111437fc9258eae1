#!/usr/bin/env python3
"""Checks that what pages, comments, scripts, scenes and the texts of verdicts refer to exists.

Usage: check_docs.py [--program CUTPROOF] [--root DIR]
       check_docs.py --self-test     whether everything that is wrong is found

In pages (*.md): relative links and their anchors, pictures, paths in backticks, words that prose no longer uses,
sentences of more than 40 words, hashes of commits, and words beyond the budgets of docs/budgets.json. With --program also
every command line: subcommand, suite and options as `--help` knows them. Everywhere: pages by name (method.md), sections
by number (method.md §3, Blade) or by title (tolerances.md, Energy), paths of our own files, and words that the glossary
has replaced. A section is a heading, or a phrase in bold. Exit status: 0 nothing found, 1 something found, 2 bad usage.
"""
import argparse
import fnmatch
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

FOLDERS = ("model", "fixtures", "reference_cpu", "gpu", "oracles", "harness", "report", "property_tests", "tuning",
           "benchmarks", "cli", "tests", "ci", "docs", "cmake", "results")
CODE = (".h", ".cpp", ".cu", ".cuh", ".py", ".sh", ".cmake", ".slurm", ".yml")
FILES = r"(?:h|cuh|cpp|cu|py|sh|md|json|cmake|svg|png|patch|slurm|yml)"
# Counterexamples, inputs and results are records of what was said when they were made; the self-test below is full of
# what must not be found.
RECORDS = ("fixtures/regressions/*.json", "fixtures/regressions/inputs/*", "results/*.json", "ci/check_docs.py")
# A word that the glossary has replaced, and what it says instead.
OLD_WORDS = {r"planted[ _]faults?": "mutant, mutation testing", r"two_runs": "relations",
             r"time-?tables?": "schedule", r"shadow runs?": "free-running", r"so manieth": "every n-th"}
# The same in the prose of pages alone: code may have a variable or a C++ term of that name.
OLD_PROSE = {r"verbs?": "subcommand", r"simplified (?:counterexamples?|cases?)": "shrunk", r"alarms?": "false positive",
             r"places? of rest": "fixed point", r"undecidable": "inconclusive", r"holders?": "containing clusters",
             r"rooms": "modules or folders", r"whoever": "name the subject", r"tried and dropped": "decisions.md lists decisions"}
SENTENCE = 40  # words at most
# Made by scripts: ci/gpu_kit.sh.
MADE = {"fixtures/scenes/kidney_1000_frames.json"}
# Options in backticks that belong to compilers, linkers and other tools.
OTHERS_OPTIONS = {"--fmad", "--wrap", "--preset", "--gtest_filter", "--gtest_fail_fast"}
PLACEHOLDER = re.compile(r"\b(?:NAME|TARGET|SUITE|SUBCOMMAND|CASE|SCENE|ROOM|STAGE)\b|NN(?=_)")


class Tree:
    """The files of the project, by their paths from its root."""

    def __init__(self, root):
        self.root = pathlib.Path(root)
        self.files = self.list_files()
        self.folders = {str(parent) for file in self.files for parent in pathlib.PurePath(file).parents}
        self.by_name = {}
        for file in self.files:
            self.by_name.setdefault(pathlib.PurePath(file).name, []).append(file)
        self.pages = {}

    def list_files(self):
        listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=self.root,
                                capture_output=True, text=True)
        top = subprocess.run(["git", "rev-parse", "--show-toplevel"], cwd=self.root, capture_output=True, text=True)
        if top.returncode == 0 and pathlib.Path(top.stdout.strip()) == self.root.resolve():
            return {name for name in listed.stdout.split("\0") if name and (self.root / name).exists()}
        found = set()
        for folder, folders, names in os.walk(self.root):
            folders[:] = [name for name in folders if name not in (".git", "build", "__pycache__")]
            found |= {str((pathlib.Path(folder) / name).relative_to(self.root)) for name in names}
        return found

    def has(self, path):
        """A file, a folder, or a pattern that some file matches."""
        path = os.path.normpath(path)
        return path in self.files or path in self.folders or \
            ("*" in path and any(fnmatch.fnmatchcase(file, path) for file in self.files))

    def text(self, file):
        return (self.root / file).read_text(encoding="utf-8", errors="replace")

    def page(self, file):
        if file not in self.pages:
            self.pages[file] = Page(self.text(file))
        return self.pages[file]

    def named_page(self, name, beside):
        """The page that a reference means: a path from the root, from the folder of the file, or a name that only one
        page has."""
        for path in (name, os.path.join(os.path.dirname(beside), name)):
            if os.path.normpath(path) in self.files:
                return os.path.normpath(path)
        found = self.by_name.get(name, []) if "/" not in name else []
        return found[0] if len(found) == 1 else None


class Page:
    """What of a page can be referred to."""

    def __init__(self, text):
        outside = re.sub(r"(?ms)^```.*?^```", "", text)
        headings = re.findall(r"(?m)^#+ +(.*?) *$", outside)
        self.numbers = {match.group(1) for match in (re.match(r"(\d+)\. ", heading) for heading in headings) if match}
        plain = [re.sub(r"^\d+\. ", "", heading).replace("`", "") for heading in headings]
        self.titles = plain + [bold.strip(" .:").replace("`", "") for bold in re.findall(r"\*\*(.+?)\*\*", outside)]
        self.anchors = set()
        for heading in headings:
            slug = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
            number = 0
            while (slug if number == 0 else f"{slug}-{number}") in self.anchors:
                number += 1
            self.anchors.add(slug if number == 0 else f"{slug}-{number}")

    def has_title(self, words):
        # The title may be named by its beginning, and the sentence may go on behind it.
        return any(words == title or title.startswith(words + " ") or words.startswith(title + " ")
                   for title in self.titles)


class Flowing:
    """A text without line breaks, comment marks and joints of string literals; knows the line of each character."""
    BREAKS = re.compile(r'"[ \t]*\n[ \t]*"|[ \t]*\n[ \t]*(?://+|#+|\*+)?[ \t]*')

    def __init__(self, text):
        parts, self.starts, line, at, length = [], [], 1, 0, 0
        for match in self.BREAKS.finditer(text):
            piece = text[at:match.start()] + ("" if match.group().startswith('"') else " ")
            parts.append(piece)
            self.starts.append((length, line))
            length += len(piece)
            line += match.group().count("\n")
            at = match.end()
        parts.append(text[at:])
        self.starts.append((length, line))
        self.text = "".join(parts)

    def line(self, offset):
        return max(start for start in self.starts if start[0] <= offset)[1]


def words(text):
    return sum(1 for token in text.split() if any(letter.isalnum() for letter in token))


def without_code(text):
    """A page whose blocks of code are blank, whose code in a line is one word, and whose links are their texts."""
    blank = lambda match: re.sub(r"[^\n]", " ", match.group())  # noqa: E731
    prose = re.sub(r"(?ms)^ *```.*?^ *```", blank, text)
    prose = re.sub(r"(?m)(?<=\n\n)(?: {4}(?![-*\d]).*\n)+", blank, prose)
    prose = re.sub(r"``.+?``|`[^`]*`", lambda match: "code" + "\n" * match.group().count("\n"), prose)
    return re.sub(r"\]\([^)\s]*\)", "]", prose)


def sentences(prose):
    """The sentences of a page without code and outside of tables, each with the line in which it begins. A heading and
    an item of a list end a sentence."""
    prose = re.sub(r"(?m)^\|.*$", "", prose)
    at = 0
    for end in re.finditer(r"[.!?][\"”’)\]*_]*(?=\s)|\n(?=\s*(?:\n|[-*] |\d+\. |#|>|<))|(?<=\n)#.*\n|\Z", prose):
        sentence = prose[at:end.end()]
        if words(sentence):
            yield 1 + prose.count("\n", 0, at + len(sentence) - len(sentence.lstrip())), sentence.strip()
        at = end.end()


class Check:
    def __init__(self, root, program=None):
        self.tree = Tree(root)
        self.problems = []
        self.commands = Commands(program) if program else None

    def run(self):
        for file in sorted(self.tree.files):
            if any(fnmatch.fnmatchcase(file, pattern) for pattern in RECORDS):
                continue
            is_page = file.endswith(".md")
            if not (is_page or file.endswith(CODE) or file.endswith("CMakeLists.txt") or
                    fnmatch.fnmatchcase(file, "fixtures/scenes/*.json")):
                continue
            text = re.sub(r"https?://\S+", lambda url: " " * len(url.group()), self.tree.text(file))
            self.old_words(file, text)
            if is_page:
                self.page(file, text)
                self.prose(file, text)
                self.hashes(file, text)
            self.references(file, text)
            if not is_page:
                self.paths(file, text)
        self.budgets()
        return self.problems

    def report(self, file, line, problem):
        self.problems.append(f"{file}:{line}: {problem}")

    # --- Everywhere ---------------------------------------------------------------------------------------------------

    def old_words(self, file, text):
        for number, line in enumerate(text.split("\n"), 1):
            for word, instead in OLD_WORDS.items():
                found = re.search(rf"(?i)(?<![a-z]){word}(?![a-z])", line)
                if found:
                    self.report(file, number, f"'{found.group()}' is an old word: {instead}")

    def references(self, file, text):
        flowing = Flowing(text)
        for found in re.finditer(r"(?<![\w/.-])((?:\.\./|\w[\w-]*/)*\w[\w-]*\.md)\b", flowing.text):
            name, behind = found.group(1), flowing.text[found.end():found.end() + 160]
            if flowing.text[found.start() - 2:found.start()] == "](":
                continue  # the target of a link: link() looks at it
            line = flowing.line(found.start())
            page = self.tree.named_page(name, file)
            if page is None:
                self.report(file, line, f"there is no page {name}")
                continue
            behind = re.sub(r"^`?(?:\]\([^)]*\))?`?", "", behind)
            self.section(file, line, name, self.tree.page(page), behind)

    def section(self, file, line, name, page, behind):
        numbered = re.match(r",? ((?:§|section )\d+(?:(?:, | and |; )§\d+)*)", behind)
        if numbered:
            for number in re.findall(r"\d+", numbered.group(1)):
                if number not in page.numbers:
                    self.report(file, line, f"{name} has no section {number}")
            behind = behind[numbered.end():]
        titled = re.match(r", [\"“]?([A-Z][^.;:,()\[\]\"”|]*)", behind)
        if titled:
            words = titled.group(1).replace("`", "").rstrip()
            if not page.has_title(words):
                self.report(file, line, f"{name} has no section '{words}'")

    def paths(self, file, text):
        folders = "|".join(FOLDERS)
        for found in re.finditer(rf"(?<![\w/.$}}*-])((?:{folders})/[\w./*-]*\.{FILES})\b", text):
            path = found.group(1)
            if path not in MADE and not path.endswith(".md") and not self.tree.has(PLACEHOLDER.sub("*", path)):
                self.report(file, text.count("\n", 0, found.start()) + 1, f"there is no {path}")

    # --- Pages --------------------------------------------------------------------------------------------------------

    def page(self, file, text):
        blank = lambda match: re.sub(r"[^\n]", " ", match.group())  # noqa: E731
        fences = list(re.finditer(r"(?ms)^```[^\n]*\n(.*?)^```", text))
        prose = re.sub(r"(?ms)^```.*?^```", blank, text)
        line_of = lambda offset: text.count("\n", 0, offset) + 1  # noqa: E731
        for link in re.finditer(r"\]\(([^()\s]+)\)", re.sub(r"`[^`\n]*`", blank, prose)):
            self.link(file, line_of(link.start()), link.group(1))
        for code in re.finditer(r"`([^`\n]+)`", prose):
            self.backticked(file, line_of(code.start()), code.group(1))
        if not self.commands:
            return
        blocks = [(fence.start(1), fence.group(1)) for fence in fences]
        blocks += [(block.start(), block.group()) for block in re.finditer(r"(?m)(?:^ {4}.*\n)+", prose)]
        for begin, block in blocks:
            joined = re.sub(r"\\\n *", lambda match: " " * len(match.group()), block)
            for line in re.finditer(r"(?m)^ *(?:\$ )?(?:[A-Z_]+=\S+ )?(?:\S*/)?(cutproof [^\n#]*)", joined):
                self.command(file, line_of(begin + line.start()), line.group(1))

    def prose(self, file, text):
        prose = without_code(text)
        for line, sentence in sentences(prose):
            if words(sentence) > SENTENCE:
                self.report(file, line, f"a sentence of {words(sentence)} words: '{' '.join(sentence.split()[:6])} …'")
        for word, instead in OLD_PROSE.items():
            for found in re.finditer(rf"(?i)(?<![\w-]){word}(?![\w-])", prose):
                self.report(file, prose.count("\n", 0, found.start()) + 1, f"'{found.group()}' is an old word: {instead}")

    def hashes(self, file, text):
        for found in re.finditer(r"(?<![\w.+-])(?!\d+e\d*\b)(?=[0-9]*[a-f])(?=[a-f]*[0-9])[0-9a-f]{7,40}\b", text):
            self.report(file, text.count("\n", 0, found.start()) + 1, f"'{found.group()}' is the hash of a commit")

    def budgets(self):
        """Pages that have no budget, budgets without a page, and pages that have more words than they may."""
        listed = "docs/budgets.json"
        if listed not in self.tree.files:
            return self.report(listed, 1, "there is no such file")
        given = json.loads(self.tree.text(listed))
        pages = {file for file in self.tree.files if file.endswith(".md") and (file.startswith("docs/") or "/" not in file)}
        named, total = set(), 0
        for budget in given["budgets"]:
            named |= set(budget["pages"])
            for page in budget["pages"]:
                if page not in pages:
                    self.report(page, 1, f"there is no such page, and {listed} has a budget for it")
            counted = sum(words(self.tree.text(page)) for page in budget["pages"] if page in pages)
            total += counted
            if counted > budget["words"]:
                self.report(budget["pages"][0], 1, f"{counted} words, {budget['words']} at most" +
                            (f" with {', '.join(budget['pages'][1:])}" if len(budget["pages"]) > 1 else ""))
        for page in sorted(pages - named):
            self.report(page, 1, f"{listed} has no budget for this page")
        if sum(budget["words"] for budget in given["budgets"]) > given["total"]:
            self.report(listed, 1, f"budgets add up to more than {given['total']} words")
        if total > given["total"] - given["kept"]:
            self.report(listed, 1, f"{total} words in all, {given['total']} at most, of which {given['kept']} are kept")

    def link(self, file, line, target):
        if re.match(r"[a-z]+:", target):
            return
        path, _, anchor = target.partition("#")
        path = os.path.normpath(os.path.join(os.path.dirname(file), path)) if path else file
        if not self.tree.has(path):
            self.report(file, line, f"the link {target} leads nowhere")
        elif anchor and path.endswith(".md") and anchor not in self.tree.page(path).anchors:
            self.report(file, line, f"{path} has no anchor #{anchor}")

    def backticked(self, file, line, text):
        path = PLACEHOLDER.sub("*", text)
        if re.fullmatch(rf"(?:{'|'.join(FOLDERS)})/[\w./*-]*", path):
            if not self.tree.has(path):
                self.report(file, line, f"there is no {text}")
        elif re.fullmatch(r"(?:cpu|h200)_[\w*]+\.json", path):
            if not self.tree.has("results/" + path):
                self.report(file, line, f"there is no results/{text}")
        elif re.fullmatch(rf"[\w*-]+\.(?:h|cuh|cpp|cu|py|sh)", path):
            if not any(fnmatch.fnmatchcase(name, path) for name in self.tree.by_name):
                self.report(file, line, f"there is no file {text}")
        elif self.commands:
            command = re.sub(r"^(?:[A-Z_]+=\S+ )", "", text)
            if command.startswith("cutproof ") or command.split(" ")[0] in self.commands.subcommands:
                self.command(file, line, command)
            elif re.match(r"--[a-z]", command):
                option = re.match(r"--[\w-]+", command).group()
                if option not in self.commands.all_options | OTHERS_OPTIONS | self.options_of_scripts():
                    self.report(file, line, f"nothing has an option {option}")

    def options_of_scripts(self):
        return {option for file in self.tree.files if file.startswith(("ci/", "guests/examples/", "docs/", "property_tests/"))
                and file.endswith((".py", ".sh", ".cpp", ".slurm")) for option in re.findall(r"--[a-z][\w-]+", self.tree.text(file))}

    def command(self, file, line, text):
        for problem in self.commands.problems(text):
            self.report(file, line, f"`{text.strip()}`: {problem}")


class Commands:
    """What a program understands, by its own help."""

    def __init__(self, program):
        self.program = program
        self.options = {}
        top = self.help()
        self.subcommands = self.subcommands_in(top)
        self.suites = self.subcommands_in(self.help("bench")) if "bench" in self.subcommands else []
        self.options[()] = self.options_in(top)
        for subcommand in self.subcommands:
            self.options[(subcommand,)] = self.options_in(self.help(subcommand))
        for suite in self.suites:
            self.options[("bench", suite)] = self.options_in(self.help("bench", suite))
        self.all_options = set().union(*self.options.values())

    def help(self, *subcommand):
        return subprocess.run([self.program, *subcommand, "--help"], check=True, capture_output=True, text=True).stdout

    @staticmethod
    def subcommands_in(text):
        return re.findall(r"(?m)^  ([a-z_-]+)  ", text.partition("Subcommands:")[2])

    @staticmethod
    def options_in(text):
        return set(re.findall(r"--[a-z][\w-]*", text))

    def problems(self, text):
        try:
            words = shlex.split(text)
        except ValueError:
            words = text.split()
        if words and words[0] == "cutproof":
            words = words[1:]
        if not words or words[0].startswith("-"):
            who, rest = (), words
        elif words[0] not in self.subcommands:
            yield f"there is no subcommand '{words[0]}'"
            return
        elif words[0] == "bench" and len(words) > 1 and re.fullmatch(r"[a-z_]+", words[1]):
            if words[1] not in self.suites:
                yield f"there is no suite '{words[1]}'"
                return
            who, rest = ("bench", words[1]), words[2:]
        else:
            who, rest = (words[0],), words[1:]
        known = self.options[who]
        if who == ("bench",):  # bench SUITE: what any suite has
            known = set().union(*(options for of, options in self.options.items() if of[:1] == ("bench",)))
        for word in rest:
            option = re.match(r"--[a-z][\w-]*", word)
            if option and option.group() not in known:
                yield f"{' '.join(('cutproof',) + who)} has no option {option.group()}"


# --- Self-test --------------------------------------------------------------------------------------------------------

SOUND = {
    "README.md": "# Project\n\nSee [the method](docs/method.md#2-blade), `model/state.h` and `fixtures/scenes/*.json`.\n\n"
                 "```\ncutproof run fixtures/scenes/a.json --check\n```\n\n`cutproof bench solver --json F`, `--json`.\n",
    "docs/method.md": "# Method\n\n## 1. Graph\n\n**I1 connected**: yes.\n\n## 2. Blade\n\nNext: [top](#method).\n",
    "docs/tolerances.md": "# Tolerances\n\n## Against the reference\n\nmethod.md §1, I1.\n",
    "model/state.h": "// docs/method.md §2 (tolerances.md, Against the\n// reference).\n",
    "model/judge.cpp": '#include "model/state.h"\nconst char* kSource = "method.md §1, "\n    "I1";\n',
    "ci/test.sh": "# model/state.h says what is tested\n",
    "fixtures/scenes/a.json": '{"description": "as method.md §2 has it"}\n',
    "docs/budgets.json": json.dumps({"total": 200, "kept": 50, "budgets": [
        {"words": 40, "pages": ["README.md"]}, {"words": 90, "pages": ["docs/method.md", "docs/tolerances.md"]}]}),
}
LONG = "So it goes" + " on" * 38 + "."  # 41 words
FORTY = "x " * 40
# What is put into a file in place of what, and what must be said.
BROKEN = [
    ("README.md", "docs/method.md#", "docs/methods.md#", "leads nowhere"),
    ("README.md", "#2-blade", "#2-plate", "no anchor #2-plate"),
    ("README.md", "`model/state.h`", "`model/stat.h`", "there is no model/stat.h"),
    ("README.md", "scenes/*.json", "scenes/*.yaml", "there is no fixtures/scenes/*.yaml"),
    ("README.md", "# Project", "# Planted faults", "old word"),
    ("README.md", "cutproof run fix", "cutproof walk fix", "no subcommand 'walk'"),
    ("README.md", "a.json --check", "a.json --chek", "no option --chek"),
    ("README.md", "bench solver", "bench sloth", "no suite 'sloth'"),
    ("README.md", "--json F", "--jsn F", "no option --jsn"),
    ("README.md", "`--json`", "`--jason`", "nothing has an option --jason"),
    ("README.md", "See ", "See methods.md and ", "no page methods.md"),
    ("docs/method.md", "#method", "#bottom", "no anchor #bottom"),
    ("docs/tolerances.md", "§1, I1", "§1, I9", "no section 'I9'"),
    ("docs/tolerances.md", "§1", "§7", "no section 7"),
    ("model/state.h", "docs/method.md", "docs/other/method.md", "no page docs/other/method.md"),
    ("model/state.h", "// reference", "// witness", "no section 'Against the witness'"),
    ("model/state.h", "§2", "§3", "no section 3"),
    ("model/judge.cpp", '"I1"', '"I2"', "no section 'I2'"),
    ("model/judge.cpp", "const", "// every so manieth\nconst", "old word"),
    ("model/judge.cpp", "const", "// oracles/two_runs\nconst", "old word"),
    ("model/judge.cpp", "const", "// the timetable\nconst", "old word"),
    ("ci/test.sh", "model/state.h", "model/gone.h", "there is no model/gone.h"),
    ("fixtures/scenes/a.json", "§2", "§4", "no section 4"),
    ("docs/method.md", "Next:", LONG + " Next:", "a sentence of 41 words: 'So it goes on on on …'"),
    ("docs/method.md", "Next:", "- " + LONG + "\n\nNext:", "a sentence of 41 words"),
    ("docs/method.md", "Next:", LONG.replace("goes", "[goes](#method)") + "\nNext:", "a sentence of 41 words"),
    ("docs/method.md", "Next:", "Each verb has an option. Next:", "'verb' is an old word: subcommand"),
    ("docs/method.md", "Next:", "| a |\n|---|\n| an alarm |\n\nNext:", "'alarm' is an old word: false positive"),
    ("docs/method.md", "Next:", "At 4ead544f it was so. Next:", "'4ead544f' is the hash of a commit"),
    ("docs/method.md", "## 2. Blade\n", "## 2. Blade\n\n```\na2faf60\n```\n", "'a2faf60' is the hash of a commit"),
    ("README.md", "See ", "| a |\n|---|\n| " + FORTY + " |\n\nSee ", "words, 40 at most"),
    ("docs/method.md", "Next:", (FORTY + ".\n\n") * 2 + "Next:", "words, 90 at most with docs/tolerances.md"),
    ("docs/budgets.json", '["README.md"]', '["README.md", "docs/guide.md"]', "there is no such page"),
    ("docs/budgets.json", ', "docs/tolerances.md"', "", "has no budget for this page"),
    ("docs/budgets.json", "200", "120", "add up to more than 120"),
    ("docs/budgets.json", "50", "190", "words in all, 200 at most, of which 190 are kept"),
]
# What must not be taken for any of that.
HARMLESS = [
    ("docs/method.md", "Next:", "```\n" + FORTY + "x\n```\n\nNext:"),
    ("docs/method.md", "Next:", "| a |\n|---|\n| " + FORTY + "x |\n\nNext:"),
    ("docs/method.md", "Next:", FORTY.strip() + ".\nNext:"),
    ("docs/method.md", "Next:", "- " + "x " * 30 + "\n- " + "x " * 30 + "\n\nNext:"),
    ("docs/method.md", "Next:", "`verb` and 0x5a5a5a5a1 take 1234567 bytes, less than 1.8446744073709552e19. Next:"),
]
PROGRAM = """#!/bin/sh
case "$*" in
  "bench --help") printf 'Subcommands:\\n  solver                      iterations\\n' ;;
  "bench solver --help") echo '  --json F' ;;
  "run --help") printf '  --check\\n  --json F\\n' ;;
  *) printf 'Subcommands:\\n  run                         simulate\\n  bench                       times\\n' ;;
esac
"""


def self_test():
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        program = pathlib.Path(folder) / "program"
        program.write_text(PROGRAM)
        program.chmod(0o755)
        root = pathlib.Path(folder) / "tree"

        def problems(change=None):
            for file, text in SOUND.items():
                if change and file == change[0]:
                    assert change[1] in text, change
                    text = text.replace(change[1], change[2], 1)
                (root / file).parent.mkdir(parents=True, exist_ok=True)
                (root / file).write_text(text, encoding="utf-8")
            return Check(root, str(program)).run()

        wrong += [f"sound, but: {problem}" for problem in problems()]
        for change in BROKEN:
            found = problems(change)
            if len(found) != 1 or change[3] not in found[0] or \
                    not found[0].startswith((change[0] + ":", "docs/" if "budgets" in change[0] else change[0] + ":")):
                wrong.append(f"{change[0]}, '{change[1]}' -> '{change[2]}': found {found}, wanted '{change[3]}'")
        wrong += [f"harmless, but: {problem}" for change in HARMLESS for problem in problems(change)]
    for line in wrong:
        print(line)
    print(f"{len(BROKEN)} broken pages and references, {'all found' if not wrong else 'SELF-TEST FAILS'}")
    return 1 if wrong else 0


def main():
    parser = argparse.ArgumentParser(description="Checks that what pages and code refer to exists.")
    parser.add_argument("--program", metavar="CUTPROOF", help="check command lines against its --help")
    parser.add_argument("--root", default=pathlib.Path(__file__).resolve().parent.parent)
    parser.add_argument("--self-test", action="store_true", help="whether everything that is wrong is found")
    options = parser.parse_args()
    if options.self_test:
        return self_test()
    check = Check(options.root, options.program)
    problems = check.run()
    pages = sum(1 for file in check.tree.files if file.endswith(".md"))
    for problem in problems:
        print(problem)
    if pages == 0:
        print(f"there are no pages in {options.root}")
        return 1
    print(f"{pages} pages and what refers to them: " +
          (f"{len(problems)} problems" if problems else "nothing wrong"))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
