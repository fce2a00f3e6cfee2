#!/usr/bin/python3
"""Checks the Markdown files: prose lines have at most 120 characters, and what a document names is
there: paths of this repository, targets of the build, links, and headings that a link points to.
README.md has to name every document in docs/. Called by tools/check.

check_documents.py --fix: wraps the paragraphs that have a longer line; nothing else is changed.
"""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
WIDTH = 120

FENCE = re.compile(r"\s*(```|~~~)")
ITEM = re.compile(r"(\s*)([-*+]|\d+[.)])(\s+)")
HEADING = re.compile(r"#{1,6}\s+(.*)")
LINK = re.compile(r"\]\(([^()\s]+)\)")
CODE = re.compile(r"`([^`\n]+)`")
# A word that would begin a list, a heading or a quotation at the start of a line.
BLOCK_START = re.compile(r"([-*+>]|#{1,6}|\d+[.)]|\|.*|=+|-+)$")
PATH = re.compile(r"[\w.*?{},+/-]+")
TARGETS = re.compile(r"--target((?: [\w-]+)+)")
PLACEHOLDER = re.compile(r"NNNN|[A-Z]{2,}_?(NAME|FILE|FOLDER)|\bNAME\b|\bFOLDER\b|\.\.\.")


def known(*patterns):
    """The files of these names that git knows, or would."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", *patterns]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return [ROOT / name for name in listed.stdout.splitlines() if (ROOT / name).is_file()]


def marked(lines):
    """Each line as (line, kind): code, table, blank, heading, item or text."""
    fenced = False
    before = "blank"
    for line in lines:
        if FENCE.match(line):
            fenced = not fenced
            kind = "code"
        elif fenced:
            kind = "code"
        elif not line.strip():
            kind = "blank"
        elif line.startswith("    ") and before in ("blank", "code") and not ITEM.match(line):
            kind = "code"
        elif line.lstrip().startswith("|"):
            kind = "table"
        elif HEADING.match(line) or line.startswith("<!--"):
            kind = "heading"
        elif ITEM.match(line):
            kind = "item"
        else:
            kind = "text"
        yield line, kind
        before = kind


def words_of(text):
    """The words of a paragraph; a short piece of code in backticks is one word."""
    def whole(code):
        return code.group(0).replace(" ", "\0") if len(code.group(0)) <= 100 else code.group(0)

    joined = CODE.sub(whole, text)
    return [word.replace("\0", " ") for word in joined.split()]


def wrapped(paragraph):
    """A paragraph, or one item of a list, in lines of at most WIDTH characters if that can be."""
    item = ITEM.match(paragraph[0])
    first = item.group(0) if item else re.match(r"\s*", paragraph[0]).group(0)
    further = " " * len(first)
    lines = []
    line = first
    for word in words_of(" ".join([paragraph[0][len(first):]] + paragraph[1:])):
        if line.strip() and line != first and len(line) + 1 + len(word) > WIDTH \
                and not BLOCK_START.match(word):
            lines.append(line)
            line = further + word
        else:
            line += word if line in (first, further) else " " + word
    return lines + [line]


def fix(path):
    result = []
    paragraph = []

    def end():
        long = any(len(line) > WIDTH for line in paragraph)
        result.extend(wrapped(paragraph) if long else paragraph)
        paragraph.clear()

    for line, kind in marked(path.read_text(encoding="utf-8").splitlines()):
        if kind != "text":
            end()
        if kind in ("text", "item"):
            paragraph.append(line)
        else:
            result.append(line)
    end()
    path.write_text("\n".join(result) + "\n", encoding="utf-8")


def anchors(path):
    """The names by which links reach a document's headings."""
    names = set()
    for line, kind in marked(path.read_text(encoding="utf-8").splitlines()):
        match = HEADING.match(line)
        if kind == "heading" and match:
            text = re.sub(r"[^\w\- ]", "", match.group(1).strip().lower())
            names.add(text.replace(" ", "-"))
    return names


def alternatives(name):
    """a/{b,c} as a/b and a/c."""
    match = re.search(r"\{([^{}]*)\}", name)
    if not match:
        return [name]
    return [found for part in match.group(1).split(",")
            for found in alternatives(name[:match.start()] + part + name[match.end():])]


def missing_paths(text, top):
    """The words of a text that begin with one of our folders and lead nowhere."""
    for name in PATH.findall(text):
        name = name.rstrip(".,").removeprefix("./")
        if "/" not in name or name.split("/")[0] not in top or PLACEHOLDER.search(name):
            continue
        for one in alternatives(name):
            if not (any(ROOT.glob(one.rstrip("/"))) if re.search(r"[*?]", one)
                    else (ROOT / one).exists()):
                yield one


def check(path, top, cmake):
    problems = []
    for number, (line, kind) in enumerate(marked(path.read_text(encoding="utf-8").splitlines()), 1):
        where = f"{path.relative_to(ROOT)}:{number}"
        if kind in ("text", "item", "heading") and len(line) > WIDTH:
            problems.append(f"{where}: {len(line)} characters, at most {WIDTH}: tools/check --fix")
        named = [line] if kind == "code" else CODE.findall(line)
        for text in named:
            problems += [f"{where}: there is no {name}" for name in missing_paths(text, top)]
            for name in [word for words in TARGETS.findall(text) for word in words.split()]:
                if not re.search(rf"(?<![\w-]){re.escape(name)}(?![\w-])", cmake):
                    problems.append(f"{where}: no CMakeLists.txt names a target {name}")
        for target in [] if kind == "code" else LINK.findall(line):
            file, _, anchor = target.partition("#")
            if re.match(r"[a-z]+:", target):
                continue
            aim = (path.parent / file).resolve() if file else path
            if not aim.exists():
                problems.append(f"{where}: the link {target} leads nowhere")
            elif anchor and anchor not in anchors(aim):
                problems.append(f"{where}: {aim.name} has no heading #{anchor}")
    return problems


def unnamed_documents(documents):
    """Documents that nobody finds from the README."""
    named = set(LINK.findall((ROOT / "README.md").read_text(encoding="utf-8")))
    for path in documents:
        name = str(path.relative_to(ROOT))
        if path.parent == ROOT / "docs" and name not in named:
            yield f"README.md: no link to {name}"


def main():
    found = known("*.md")
    if sys.argv[1:] == ["--fix"]:
        for path in found:
            fix(path)
    top = {entry.name for entry in ROOT.iterdir()
           if entry.is_dir() and entry.name != ".git" and not entry.name.startswith("build")}
    cmake = "\n".join(path.read_text(encoding="utf-8")
                      for path in known("CMakeLists.txt", "*/CMakeLists.txt", "*.cmake"))
    problems = [problem for path in found for problem in check(path, top, cmake)]
    problems += unnamed_documents(found)
    for problem in problems:
        print(problem)
    if problems:
        sys.exit("check_documents: long lines, or names of what is not there")


if __name__ == "__main__":
    main()
