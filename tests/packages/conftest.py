"""Packages as a release has them: built by tools/package, once for each system, kept in the build
folder as long as no source changes. SWARMTALK_PACKAGES=all: also what needs a build of its own,
some minutes each.
"""
import fcntl
import hashlib
import os
import pathlib
import shutil
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("SWARMTALK_BUILD", ROOT / "build-test")).resolve()
sys.path.insert(0, str(ROOT / "tests/support"))

import booted  # noqa: E402

OWN_ARCHITECTURE = subprocess.run(["dpkg", "--print-architecture"], text=True, check=True,
                                  capture_output=True).stdout.strip()
BUILD_TIMEOUT_S = 3000


def only_with_all(what):
    """Skips what takes minutes of all processors for one question, unless somebody asked for it."""
    if os.environ.get("SWARMTALK_PACKAGES") != "all":
        pytest.skip(f"{what}: a build of its own, set SWARMTALK_PACKAGES=all")


def sources():
    """The files of the tree that git knows, or would."""
    listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
                            cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return [name for name in sorted(listed.split("\0")) if name and (ROOT / name).is_file()]


def sources_key():
    """Changes when a file changes that packages are made of."""
    key = hashlib.md5()
    for name in sources():
        if not name.startswith(("tests/", "benchmarks/", "emulation/")):
            key.update(name.encode() + b"\0" + (ROOT / name).read_bytes())
    return key.hexdigest()[:10]


def copy_of_tree(folder):
    """The tree without anything built, with its history."""
    for name in [*sources(), ".git"]:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy(ROOT / name, folder / name)
    return folder


def build(folder, *options, script=None, **environment):
    """Packages by tools/package, as a dictionary from name to path."""
    command = [str(script or ROOT / "tools/package"), *map(str, options), str(folder)]
    environment = {**os.environ, "SWARMTALK_ROOTS": str(BUILD / "packages/roots"), **environment}
    done = subprocess.run(command, capture_output=True, text=True, timeout=BUILD_TIMEOUT_S,
                          env=environment)
    if "tools/build-root: cannot make" in done.stderr:
        pytest.skip("no root to build in: " + done.stderr.strip().splitlines()[-1])
    assert done.returncode == 0, done.stdout[-1000:] + done.stderr[-3000:]
    return {package.name.split("_")[0]: package for package in folder.glob("*.deb")}


def bare_root(folder, suite, variant="apt", *include):
    """Of that Debian, with nothing but apt and the packages of `include`."""
    done = booted.run("mmdebstrap", "--quiet", f"--variant={variant}",
                      *([f"--include={','.join(include)}"] if include else []),
                      suite, folder, booted.mirror(), timeout=900)
    if done.returncode != 0:
        pytest.skip(f"no root of {suite}: {(done.stderr.strip().splitlines() or ['?'])[-1]}")


def packages_of(suite=booted.OWN_SUITE, architecture=OWN_ARCHITECTURE):
    """Built at most once for each state of the sources. Skips what nobody asked for."""
    booted.needs("dh", "git")
    own = suite == booted.OWN_SUITE and architecture == OWN_ARCHITECTURE
    if not own:
        only_with_all(f"packages for {suite} {architecture}")
        if os.geteuid() != 0:
            pytest.skip("a root to build in needs root")
        booted.needs("mmdebstrap")
    folder = BUILD / "packages" / f"{suite}-{architecture}-{sources_key()}"
    folder.parent.mkdir(parents=True, exist_ok=True)
    with open(folder.parent / f"{suite}-{architecture}.lock", "w", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / "done").exists():
            for old in folder.parent.glob(f"{suite}-{architecture}-*/"):
                shutil.rmtree(old)
            folder.mkdir()
            build(folder, *([] if own else ["--suite", suite, "--arch", architecture]))
            (folder / "done").touch()
    built = {package.name.split("_")[0]: package for package in folder.glob("*.deb")}
    if own:
        return built
    # Those for all architectures are the same everywhere.
    return {**{name: package for name, package in packages_of().items()
               if package.name.endswith("_all.deb")}, **built}


def older(packages, folder):
    """The same packages with a lower version: those of SWARMTALK_OLDER_PACKAGES, a folder with the
    release before; else these once more, with another version number and another line in the
    configuration, so that everything that an upgrade does is done."""
    if "SWARMTALK_OLDER_PACKAGES" in os.environ:
        given = pathlib.Path(os.environ["SWARMTALK_OLDER_PACKAGES"])
        return {package.name.split("_")[0]: package for package in given.glob("*.deb")}
    folder.mkdir()
    result = {}
    for name, package in packages.items():
        tree = folder / name
        subprocess.run(["dpkg-deb", "--raw-extract", package, tree], check=True)
        control = tree / "DEBIAN/control"
        text = control.read_text(encoding="utf-8")
        version = next(line for line in text.splitlines() if line.startswith("Version: "))[9:]
        control.write_text(text.replace(version, "0.0.9"), encoding="utf-8")
        config = tree / "etc/swarmtalk/swarmtalkd.toml"
        if config.exists():
            config.write_text("# The version before.\n" + config.read_text(encoding="utf-8"),
                              encoding="utf-8")
        result[name] = folder / f"{name}_0.0.9.deb"
        subprocess.run(["dpkg-deb", "--root-owner-group", "--build", tree, result[name]],
                       check=True, capture_output=True)
    return result
