#!/usr/bin/python3
"""Checks that one version is meant everywhere: CMakeLists.txt says it, the Debian changelog,
CITATION.cff and the programs in Python repeat it. A commit with the tag vVERSION has the heading
[VERSION] in CHANGELOG.md and a distribution in debian/changelog, others have neither. Called by
tools/check.
"""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent


def found(path, pattern):
    match = re.search(pattern, (ROOT / path).read_text(encoding="utf-8"), re.M)
    return match.groups() if match else ("nothing",) * re.compile(pattern).groups


def problems():
    (version,) = found("CMakeLists.txt", r"^project\(swarmtalk VERSION (\d+\.\d+\.\d+) ")
    name, debian, distribution = found("debian/changelog", r"\A(\S+) \((\S+)\) (\S+);")
    (cited,) = found("CITATION.cff", r"^version: (\S+)$")
    if name != "swarmtalkd" or debian != version:
        yield f"debian/changelog begins with {name} {debian}, CMakeLists.txt says {version}"
    if cited != version:
        yield f"CITATION.cff says version {cited}, CMakeLists.txt says {version}"
    for path, name in (("suite/swarmtalk-suite", "VERSION"),
                       ("client_lib/python/swarmtalk.py", "__version__")):
        (said,) = found(path, rf'^{name} = "(\S+)"$')
        if said != version:
            yield f"{path} says version {said}, CMakeLists.txt says {version}"
    tags = subprocess.run(["git", "tag", "--points-at", "HEAD", "v*"], cwd=ROOT, text=True,
                          capture_output=True, check=False).stdout.split()
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    is_told = re.search(rf"^## \[{re.escape(version)}\]", changes, re.M) is not None
    for tag in tags:
        if tag != f"v{version}":
            yield f"the commit has the tag {tag}, and is version {version}"
        elif not is_told or distribution == "UNRELEASED":
            yield (f"{tag}: CHANGELOG.md needs a heading [{version}], and debian/changelog a "
                   f"distribution instead of {distribution}")
    if is_told != (distribution != "UNRELEASED"):
        yield (f"version {version} is {'' if is_told else 'not '}a heading of CHANGELOG.md, and "
               f"{distribution} in debian/changelog")


if __name__ == "__main__":
    wrong = list(problems())
    for line in wrong:
        print(line)
    sys.exit(1 if wrong else 0)
