"""The unit's limit of memory as systemd sets it today, in a control group of version 2: in a
virtual machine with a kernel of its own (lab/wifi), since a container has the groups that its host
has."""
import os
import pathlib
import re
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests/wifi"))

import guest  # noqa: E402

pytestmark = pytest.mark.field
GROUPS = "/sys/fs/cgroup"
PATIENCE_S = 900  # an emulated processor


def test_hostile_programs_fill_every_limit_and_the_group_of_version_2_holds():
    guest.needs_guest()
    with guest.Guest(radios=1, access_points=0, memory_mb=1536) as machine:
        machine.check("", f"mount -t cgroup2 cgroup2 {GROUPS}")
        assert "memory" in machine.check("", "cat", f"{GROUPS}/cgroup.controllers")
        done = machine.run(
            "", "/usr/bin/python3", "-B", "-m", "pytest", "-q", "-s", "-rs", "-p",
            "no:cacheprovider", str(ROOT / "tests/hostile/test_local.py"),
            "-k", "all_limits_used_up", timeout=PATIENCE_S,
            env={"SWARMTALK_BUILD": str(guest.BUILD), "SWARMTALK_WAIT_S": "240",
                 "SWARMTALK_SEED": os.environ["SWARMTALK_SEED"]})
        print(done.stdout)
        assert done.returncode == 0 and "1 passed" in done.stdout, done.stdout + done.stderr
        used = int(re.search(r"(\d+) KiB of \d+ in use", done.stdout)[1])
        assert 20 * 1024 < used, "nothing was filled"
        assert "Out of memory" not in machine.console() + machine.check("", "dmesg")
