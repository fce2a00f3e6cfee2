"""docs/tutorial.md, typed as it stands there, with the programs of this build. tests/packages does
it with installed packages."""
import os
import shutil
import subprocess
import sys

import pytest
from blocks import BUILD, PROGRAMS, ROOT

sys.path.insert(0, str(ROOT / "tests/support"))
import tutorial  # noqa: E402

# What a program of the system would do where the library is installed.
PKG_CONFIG = f"""#!/bin/sh
[ "$*" = "--cflags --libs swarmtalk" ] || exit 1
echo -I{ROOT}/client_lib/include {BUILD}/client_lib/libswarmtalk.a -lprotobuf -pthread
"""


def write_path(folder):
    folder.mkdir()
    for name, path in PROGRAMS.items():
        (folder / name).symlink_to(path)
    (folder / "sudo").write_text('#!/bin/sh\nexec "$@"\n')
    (folder / "pkg-config").write_text(PKG_CONFIG)
    (folder / "python3").symlink_to("/usr/bin/python3")
    for name in ("sudo", "pkg-config"):
        (folder / name).chmod(0o755)


@pytest.mark.clock
@pytest.mark.skipif(os.geteuid() != 0, reason="network namespaces need root")
def test_its_commands_do_what_it_says(tmp_path):
    for program in ("g++", "ip"):
        if shutil.which(program) is None:
            pytest.skip(f"{program} is missing: run tools/setup test")
    tutorial.write_programs(tmp_path)
    write_path(tmp_path / "path")
    environment = {**os.environ, "PATH": f"{tmp_path}/path:{os.environ['PATH']}",
                   "PYTHONPATH": f"{ROOT}/client_lib/python", "SWARMTALK_LAB": f"tut{os.getpid()}",
                   "PYTHONUNBUFFERED": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    options = {"cwd": tmp_path, "env": environment}

    def status():
        return subprocess.run([PROGRAMS["swarmtalk-lab"], "exec", "2", "--",
                               PROGRAMS["swarmtalk-cli"], "status"], capture_output=True,
                              text=True, env=environment).stdout

    def wanted(_before, block):
        return not tutorial.installs(block)

    try:
        text = tutorial.type_all(wanted, ["bash", "-e", "-c"], status, **options)
    finally:
        subprocess.run([PROGRAMS["swarmtalk-lab"], "down"], capture_output=True, **options)
    tutorial.check(text, programs=2)
