"""docs/tutorial.md, typed as it stands there, with the programs of this build, by root and by
somebody without sudo. tests/packages does it with installed packages."""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import pytest
from blocks import BUILD, PROGRAMS, ROOT

sys.path.insert(0, str(ROOT / "tests/support"))
import tutorial  # noqa: E402

# What a program of the system would do where the library is installed.
PKG_CONFIG = f"""#!/bin/sh
[ "$*" = "--cflags --libs swarmtalk" ] || exit 1
echo -I{ROOT}/client_lib/include {BUILD}/client_lib/libswarmtalk.a -lprotobuf -pthread
"""


AS_NOBODY = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups", "env",
             "--unset=XDG_RUNTIME_DIR"]


def write_path(folder):
    """Copies, since the build folder may be closed to other users."""
    programs = {**PROGRAMS, "swarmtalk-view": BUILD / "view/swarmtalk-view"}
    for path in [*programs.values(), ROOT / "client_lib/python/swarmtalk.py"]:
        place = folder.parent / path.parent.name / path.name
        place.parent.mkdir()
        shutil.copy(path, place)
    folder.mkdir()
    for name, path in programs.items():
        (folder / name).symlink_to(folder.parent / path.parent.name / name)
    (folder / "sudo").write_text('#!/bin/sh\nexec "$@"\n')
    (folder / "pkg-config").write_text(PKG_CONFIG)
    (folder / "python3").symlink_to("/usr/bin/python3")
    for name in ("sudo", "pkg-config"):
        (folder / name).chmod(0o755)


@pytest.fixture
def folder_of_everybody():
    """One that other users may enter and write to, which pytest's own are not."""
    with tempfile.TemporaryDirectory(dir="/tmp", prefix="swarmtalk-test") as folder:
        pathlib.Path(folder).chmod(0o777)
        yield pathlib.Path(folder)


@pytest.mark.clock
@pytest.mark.skipif(os.geteuid() != 0, reason="network namespaces need root")
@pytest.mark.parametrize("is_root", [True, False], ids=["root", "nobody"])
def test_its_commands_do_what_it_says(folder_of_everybody, is_root):
    for program in ("g++", "ip"):
        if shutil.which(program) is None:
            pytest.skip(f"{program} is missing: run tools/setup test")
    folder = folder_of_everybody
    tutorial.write_programs(folder)
    write_path(folder / "path")
    environment = {**os.environ, "PATH": f"{folder}/path:{os.environ['PATH']}",
                   "PYTHONPATH": f"{folder}/python", "SWARMTALK_LAB": f"tut{os.getpid()}",
                   "PYTHONUNBUFFERED": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    options = {"cwd": folder, "env": environment}
    typed_by = [] if is_root else AS_NOBODY
    lab = [*typed_by, folder / "path/swarmtalk-lab"]

    def status():
        return subprocess.run([*lab, "exec", "2", "--", "swarmtalk-cli", "status"],
                              capture_output=True, text=True, env=environment).stdout

    def wanted(before, block):  # nobody may not read the headers of this tree
        return not tutorial.installs(block) and (is_root or not tutorial.is_for_cpp(before))

    try:
        text = tutorial.type_all(wanted, [*typed_by, "bash", "-e", "-c"], status, **options)
    finally:
        subprocess.run([*lab, "down"], capture_output=True, **options)
    tutorial.check(text, programs=2 if is_root else 1)
