"""Which tests tools/test -R and --changed run, and what has to be built for them.

Reads a configured build folder: what ninja knows about files, what ctest knows about tests, and
test_programs.txt, test_needs.txt and the lists in pytest/, which cmake writes. Writes two files
into a folder: "targets", one of ninja's targets a line, and "tests", a regular expression for
ctest. An empty "tests" means that there is nothing to run. With --find: prints the expression only.
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys
import typing

ROOT = pathlib.Path(__file__).resolve().parents[1]
BUILD = ROOT / "build-test"
LIMIT_S = 120  # what a change of one file should take; more is told
SLOW_S = 120  # a test, or a file of pytest's, that takes longer than that is left to tools/test
TEST_MACRO = re.compile(r"\b(?:TYPED_TEST|TEST|TEST_F|TEST_P|RC_GTEST_PROP|RC_GTEST_FIXTURE_PROP)"
                        r"\(\s*(\w+),\s*(\w+)")
INSTANCE_MACRO = re.compile(r"\bINSTANTIATE_TEST_SUITE_P\(\s*(\w*),\s*(\w+)")
ADD_TEST = re.compile(r"^add_test\(\[=\[(.+?)\]=\] (.*)\)$", re.MULTILINE)
WHOLE_BUILD = re.compile(r"(^|/)CMakeLists\.txt$|\.cmake$|^CMakePresets\.json$|^tools/setup$")


def fail(text: str):
    sys.exit(f"tools/test: {text}")


def output_of(*command) -> str:
    done = subprocess.run([str(word) for word in command], cwd=ROOT, capture_output=True, text=True)
    if done.returncode != 0:
        words = " ".join(map(str, command[:4]))
        fail(f"{words} failed: {done.stderr.strip() or done.stdout[-300:]}")
    return done.stdout


def ninja(*arguments) -> str:
    return output_of("ninja", "-C", BUILD, *arguments)


def in_tree(path: str) -> str:
    """A path of ninja's, which is absolute or begins at the build folder, as git writes it; what
    was made by the build keeps its path there."""
    full = pathlib.Path(path) if path.startswith("/") else BUILD / path
    text = str(full.parent.resolve() / full.name) if ".." in path else str(full)
    for folder in (BUILD, ROOT):
        if text.startswith(f"{folder}/"):
            return text[len(str(folder)) + 1:]
    return text


class Build:
    """What is in the build folder."""

    def __init__(self):
        self.tests = [test for test in json.loads(output_of(
            "ctest", "--test-dir", BUILD, "--show-only=json-v1"))["tests"]
            if not test["name"].endswith("_NOT_BUILT")]
        # ctest says no command whose program is not built yet.
        commands = {}
        for path in BUILD.rglob("CTestTestfile.cmake"):
            commands.update(ADD_TEST.findall(path.read_text()))
        for test in self.tests:
            test.setdefault("command", re.findall(r'"([^"]*)"', commands.get(test["name"], "")))
        self.programs = (BUILD / "test_programs.txt").read_text().split()
        self.needs = {}  # folder of pytest's, or a script in one -> targets
        for line in (BUILD / "test_needs.txt").read_text().splitlines():
            folder, *targets = line.split()
            self.needs[folder] = targets
        self.inputs_ = {}

    def inputs(self, target: str) -> set[str]:
        """Every file that the target is made of, sources included."""
        if target not in self.inputs_:
            self.inputs_[target] = {in_tree(line) for line in ninja("-t", "inputs", target)
                                    .splitlines() if not line.startswith("ninja: ")}
        return self.inputs_[target]

    def sources(self, program: str) -> set[pathlib.Path]:
        """The program's test sources; those that are compiled as one are named in the file that
        joins them, which cmake writes."""
        found = set()
        for path in self.inputs(program):
            if not path.endswith(".cpp"):
                continue
            if (BUILD / path).exists():
                found |= {ROOT / name for name in
                          re.findall(r'#include "([^"]+)"', (BUILD / path).read_text())}
            else:
                found.add(ROOT / path)
        return {path for path in found if str(path).startswith(f"{ROOT}/tests/")}

    def names(self, program: str) -> list[str]:
        """Names that ctest has, or will have, for a GoogleTest program."""
        names = []
        for source in self.sources(program):
            text = source.read_text()
            instances = {}
            for instance, suite in INSTANCE_MACRO.findall(text):
                instances.setdefault(suite, []).append(instance)
            for suite, test in TEST_MACRO.findall(text):
                names += [f"{instance}/{suite}.{test}/0" for instance in instances.get(suite, [])]
                names.append(f"{suite}.{test}")
        return names

    @staticmethod
    def is_field(test: dict) -> bool:
        return any(item["name"] == "LABELS" and "field" in item["value"]
                   for item in test["properties"])

    @staticmethod
    def folder(test: dict) -> str:
        return next((item["value"] for item in test["properties"]
                     if item["name"] == "WORKING_DIRECTORY"), "")

    def targets(self, test: dict) -> list[str]:
        """What the command of a test needs: files and folders of the build that it names."""
        folder = self.folder(test)
        if folder in self.needs:
            script = f"{folder}/{test['command'][-1]}"
            return self.needs.get(script, self.needs[folder])
        command = " ".join(test["command"])
        found = re.findall(re.escape(f"{BUILD}/") + r"([\w./+-]+)", command)
        return [f"{path}/all" if (BUILD / path).is_dir() else path for path in found]

    def program(self, test: dict) -> str:
        """The GoogleTest program of a test, or nothing."""
        name = pathlib.Path((test["command"] or [""])[0]).name
        return name if name in self.programs else ""


def literal(text: str) -> str:
    return re.sub(r"([][().*+?^$|\\])", r"\\\1", text)


class Picked(typing.NamedTuple):
    """Ninja's targets, and regular expressions for ctest: what runs, and what of it does not."""
    targets: set[str] = set()
    tests: str = ""
    without: str = ""


def pattern(suites: set[str], names: set[str]) -> str:
    """A regular expression for ctest, which takes no long expression and few parentheses: suites of
    GoogleTest, with or without "INSTANCE/" before, and whole names."""
    parts = [text for suite in sorted(suites) for text in (f"^{suite}[./]", f"/{suite}[./]")]
    return "|".join(parts + ["^" + literal(name) + "$" for name in sorted(names)])


def files_with(names: str, build: pathlib.Path) -> set[str]:
    """The names to ctest of pytest's files that have a test whose name is found."""
    found = set()
    for path in (build / "pytest").glob("*.txt"):
        for line in path.read_text().splitlines():
            kind, _, name = line.split(" ", 2)
            if kind != "not" and re.search(names, name):
                found.add(".".join([*name.split(".")[:2], kind]))
    return found


def expression(names: str, build: pathlib.Path) -> str:
    """For ctest: what `names` finds, and the files of pytest's that have such tests."""
    return "|".join([names, *("^" + literal(name) + "$" for name in
                              sorted(files_with(names, build)) if not re.search(names, name))])


def by_names(build: Build, names: str) -> Picked:
    wanted = re.compile(names)
    scripts = files_with(names, BUILD)
    targets = set()
    found = 0
    for test in build.tests:
        if test["name"] in scripts or (build.folder(test) not in build.needs
                                       and wanted.search(test["name"])):
            found += 1
            targets |= set(build.targets(test))
    for program in build.programs:
        if any(wanted.search(name) for name in build.names(program)):
            found += 1
            targets.add(program)
    if not found:
        fail(f"no test has a name that matches '{names}'; see ctest --test-dir build-test "
             "-N, and build-test/pytest/ for those in Python")
    return Picked(targets, expression(names, BUILD), "")


def changed_files(since: str) -> tuple[str, list[str]]:
    """@return since when in words, and the files that differ from then"""
    words = f"since {since}"
    if not since:
        since, words = "HEAD", "since the last commit"
        for main in ("origin/main", "main"):
            base = subprocess.run(["git", "merge-base", "HEAD", main], cwd=ROOT,
                                  capture_output=True, text=True)
            if base.returncode == 0:
                since = base.stdout.strip()
                words = f"since this branch left {main}"
                break
    diff = output_of("git", "diff", "--name-only", "--no-renames", since, "--").split("\n")
    new = output_of("git", "ls-files", "--others", "--exclude-standard").split("\n")
    return words, sorted({name for name in diff + new if name})


class Touched:
    """What a list of changed files touches."""

    def __init__(self, build: Build, files: list[str]):
        self.build = build
        self.files = set(files)
        self.known = set()    # files that some test depends on
        self.objects = set()  # of ninja's outputs
        output = ""
        for line in ninja("-t", "deps").splitlines():
            if line.startswith(" "):
                name = in_tree(line.strip())
                if name in self.files:
                    self.objects.add(output)
                    self.known.add(name)
            elif line:
                output = in_tree(line.split(": #deps")[0])

    def is_hit(self, target: str) -> bool:
        inputs = self.build.inputs(target) | {target}
        self.known |= inputs & self.files
        return bool(inputs & (self.objects | self.files))

    def is_named(self, sources) -> bool:
        """Whether one of these names a changed file that is not compiled, such as a document."""
        loose = {pathlib.Path(name).name: name for name in self.files
                 if not name.endswith((".py", ".cpp", ".hpp", ".c", ".h"))}
        text = "".join(path.read_text() for path in sources) if loose else ""
        hit = {path for name, path in loose.items() if name in text}
        self.known |= hit
        return bool(hit)

    def scripts(self) -> set[str]:
        """Tests of changed Python files: of a helper, those of its whole folder. And tests that
        name a changed file that is not compiled."""
        names = set()
        for test in self.build.tests:
            folder = self.build.folder(test)
            if folder not in self.build.needs:
                continue
            script = pathlib.Path(folder) / test["command"][-1]
            helpers = {str(path.relative_to(ROOT)) for path in pathlib.Path(folder).glob("*.py")
                       if not path.name.startswith("test_")}
            hit = self.files & (helpers | {str(script.relative_to(ROOT))})
            if hit or self.is_named([script]):
                names.add(test["name"])
                self.known |= hit
        for test in self.build.tests:
            command = " ".join(test["command"])
            hit = {name for name in self.files if f"{ROOT}/{name}" in command or any(
                f"{ROOT}/{parent}" in test["command"]
                for parent in pathlib.Path(name).parents)}
            if hit:
                names.add(test["name"])
                self.known |= hit
        return names


def costs() -> dict[str, float]:
    """Seconds of each test when it ran last."""
    path = BUILD / "Testing/Temporary/CTestCostData.txt"
    found = {}
    for line in path.read_text().splitlines() if path.exists() else []:
        if line == "---":
            break
        name, _, cost = line.rsplit(" ", 2)
        found[name] = float(cost)
    return found


def compile_s(outputs: set[str]) -> float:
    """Seconds that these outputs took when they were made last."""
    took = {}
    for line in (BUILD / ".ninja_log").read_text().splitlines()[1:]:
        start, end, _, output, *_ = line.split("\t")
        took[output] = (int(end) - int(start)) / 1000
    return sum(took.get(output, 0) for output in outputs)


def by_change(build: Build, since: str, jobs: int) -> Picked:
    words, files = changed_files(since)
    if not files:
        print(f"Nothing has changed {words}.")
        return Picked()
    if not (BUILD / ".ninja_deps").exists():
        fail("--changed needs an earlier build to know what a file touches; run tools/test once")
    print(f"{len(files)} files have changed {words}.")
    whole = [name for name in files if WHOLE_BUILD.search(name)]
    if whole:
        print(f"{whole[0]} decides about the whole build, so all tests run, as with tools/test.")
        return Picked({"all"}, ".", "")
    touched = Touched(build, files)
    targets = {program for program in build.programs
               if touched.is_hit(program) or touched.is_named(build.sources(program))}
    suites = {name.split(".")[0].split("/")[-1] for program in targets
              for name in build.names(program)}
    picked = [test for test in build.tests if build.program(test) in targets]
    scripts = touched.scripts()
    names = set()
    for test in build.tests:
        needed = build.targets(test)
        # All of them, so that each file that anything depends on is known.
        is_hit = any([touched.is_hit(target) for target in needed])
        if ((is_hit or test["name"] in scripts) and not build.is_field(test)
                and not build.program(test)):
            names.add(test["name"])
            targets |= set(needed)
            picked.append(test)
    for name in sorted(set(files) - touched.known):
        print(f"  no test is known to depend on {name}")
    known = costs()
    slow = {test["name"] for test in picked if known.get(test["name"], 0) > SLOW_S}
    for name in sorted(slow):
        print(f"  left out, for it takes {known[name]:.0f} s: {name}")
    test_s = sum(known.get(test["name"], 0.1) for test in picked if test["name"] not in slow)
    compiled = touched.objects | {name for name in targets if "/" in name}
    total_s = test_s / jobs + compile_s(compiled)
    print(f"{len(picked) - len(slow)} tests, {len(touched.objects)} files to compile: about "
          f"{total_s:.0f} s" + (", for much depends on this" if total_s > LIMIT_S else ""))
    return Picked(targets, pattern(suites, names), pattern(set(), slow))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--names")
    parser.add_argument("--changed", metavar="COMMIT")
    parser.add_argument("--find", metavar="NAMES")
    parser.add_argument("--folder", type=pathlib.Path, default=BUILD)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--into", type=pathlib.Path)
    options = parser.parse_args()
    if options.find is not None:
        print(expression(options.find, options.folder))
        return
    build = Build()
    picked = by_names(build, options.names) if options.names is not None else \
        by_change(build, options.changed or "", options.jobs)
    (options.into / "targets").write_text("".join(f"{name}\n" for name in sorted(picked.targets)))
    (options.into / "tests").write_text(picked.tests)
    (options.into / "without").write_text(picked.without)


if __name__ == "__main__":
    main()
