#!/usr/bin/python3
"""tools/test_results.py FOLDER: what came of the tests that ctest has just run in a build folder,
for tools/test: "PASSED SKIPPED", then "failed NAME" or "ended NAME" a line. "ended" is a file of
pytest's that did not come to its end, with the test that it was at: nobody knows about the others.
Then, a line for each reason for which tests were skipped: "skipped COUNT, such as NAME: WHY", or
"lacking ..." where a machine has no excuse for it.

ctest's own report has GoogleTest's tests and programs; a file of pytest's is one test to ctest, and
its tests are read from the report that pytest wrote (cmake/SwarmtalkPytest.cmake). So are those of
a program of GoogleTest's with sanitizers (swarmtalk_shards in cmake/SwarmtalkBuild.cmake).
"""
import pathlib
import re
import sys
import typing
import xml.etree.ElementTree

BEGUN = re.compile(r"^\[ RUN      \] (.+)$", re.MULTILINE)
SKIPPED = re.compile(r"^skipped: (.*)$|: Skipped\n(.*)$|^SKIPPED \[\d+\] [^ ]+ (.*)$", re.MULTILINE)
# What a machine may lack: a reason has one of these words. All else tools/setup installs.
EXCUSES = re.compile(r"\broot\b|\bnamespaces?\b|\bkernel\b|\bkilolib\b|of this machine's kind")
WORST = ("passed", "skipped", "failed", "ended")


class Result(typing.NamedTuple):
    """Of one test: "passed", "skipped" (and why), "failed" or "ended"."""
    name: str
    came: str
    why: str = ""


def of_ctest(case) -> Result:
    name, skipped = case.get("name"), case.find("skipped")
    if case.get("status") == "run":
        return Result(name, "passed")
    if skipped is not None and "SKIP" in skipped.get("message", ""):
        reason = SKIPPED.search(case.findtext("system-out") or "")
        return Result(name, "skipped", next(filter(None, reason.groups()), "") if reason
                      else "without a reason")
    return Result(name, "failed")  # also one whose program is missing


def of_gtest(suites) -> list[Result]:
    """Under the names that ctest gives them in other builds."""
    found = []
    for case in suites.iter("testcase"):
        suite, name = case.get("classname"), case.get("name")
        if case.get("type_param"):
            suite, name = suite.rpartition("/")[0], f"{name}<{case.get('type_param')}>"
        elif case.get("value_param"):
            name = f"{name.rpartition('/')[0]}/{case.get('value_param')}"
        skipped = case.find("skipped")
        if case.find("failure") is not None:
            came = "failed"
        else:
            came = "passed" if skipped is None else "skipped"
        if case.get("status") == "run":
            found.append(Result(f"{suite}.{name}", came,
                                "" if skipped is None else skipped.get("message", "")))
    return found


def of_report(path: pathlib.Path) -> list[Result]:
    root = xml.etree.ElementTree.parse(path).getroot()
    return of_gtest(root) if root.get("name") == "AllTests" else of_pytest(path, root)


def of_pytest(path: pathlib.Path, root) -> list[Result]:
    """The tests of the report PREFIX.FILE.KIND.xml. One that failed and could not clean up either
    is in it twice."""
    of_script = path.name.rsplit(".", 2)[0]
    script, found = re.escape(of_script.split(".")[1]), {}
    for case in root.iter("testcase"):
        # "python.test_client" or "python.test_client.Class"; nothing for a file that cannot be read
        scope = re.search(rf"(?:^|\.)(?:test_)?{script}((?:\.\w+)*)$", case.get("classname"))
        name = of_script + (f"{scope[1]}.{case.get('name').removeprefix('test_')}" if scope else "")
        skipped = case.find("skipped")
        if case.find("failure") is not None or case.find("error") is not None:
            result = Result(name, "failed")
        elif skipped is not None:
            result = Result(name, "skipped", skipped.get("message", "without a reason"))
        else:
            result = Result(name, "passed")
        if name not in found or WORST.index(result.came) > WORST.index(found[name].came):
            found[name] = result
    return list(found.values())


def read(folder: pathlib.Path) -> list[Result]:
    """All tests of the last run; if it was interrupted, those of the files that were finished."""
    reports = folder / "Testing/pytest"
    found, of_files = [], set()
    ctest = folder / "Testing/results.xml"
    cases = xml.etree.ElementTree.parse(ctest).getroot().iter("testcase") if ctest.exists() else ()
    for case in cases:
        entry = of_ctest(case)
        report, begun = reports / f"{entry.name}.xml", reports / f"{entry.name}.begun"
        if report.exists():
            of_files.add(report)
            results = of_report(report)
            found += results
            if entry.came == "failed" and all(each.came != "failed" for each in results):
                found.append(Result(entry.name, "ended"))
        elif begun.exists():
            found.append(Result(begun.read_text(encoding="utf-8"), "ended"))
        elif entry.came == "failed" and entry.name.startswith("Sanitized."):
            at = BEGUN.findall(case.findtext("system-out") or "")
            found.append(Result(at[-1].split(", where")[0] if at else entry.name, "ended"))
        else:
            found.append(entry)
    if not ctest.exists() and reports.exists():
        for report in sorted(set(reports.glob("*.xml")) - of_files):
            found += of_report(report)
    return found


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    results = read(pathlib.Path(sys.argv[1]))
    count = {word: sum(each.came == word for each in results) for word in WORST}
    print(count["passed"], count["skipped"])
    for each in results:
        if each.came in ("failed", "ended"):
            print(each.came, each.name)
    skipped = {}
    for each in results:
        if each.came == "skipped":
            skipped.setdefault(each.why, []).append(each.name)
    for why, names in skipped.items():
        print("skipped" if EXCUSES.search(why) else "lacking",
              f"{len(names)}, such as {names[0]}: {' '.join(why.split())}")


if __name__ == "__main__":
    main()
