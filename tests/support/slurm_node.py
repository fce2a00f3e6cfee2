"""A Slurm of one node, this machine: its daemons in a network namespace, all files in a folder."""
import os
import pathlib
import shutil
import subprocess
import time

PROGRAMS = ("slurmctld", "slurmd", "sbatch", "squeue", "scancel", "munged")
CONF = """ClusterName=sweep
SlurmctldHost={host}({address})
AuthType=auth/munge
CryptoType=crypto/munge
AuthInfo=socket={folder}/munge.socket
SlurmUser=root
SlurmdUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
SlurmdTimeout=10
KillWait=2
SchedulerParameters=sched_interval=1,batch_sched_delay=1
NodeName={host} NodeAddr={address} CPUs={cores} RealMemory=100 State=UNKNOWN
PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""
WAIT_S = 90
ADDRESS = "10.99.0.1"  # Slurm wants one that is not loopback's; nothing is at the wire's other end


def missing() -> str | None:
    """Why there can be none here."""
    if os.geteuid() != 0:
        return "Slurm's daemons need root"
    if subprocess.run(["unshare", "--net", "true"], capture_output=True).returncode != 0:
        return "no network namespaces here"
    absent = [p for p in PROGRAMS if shutil.which(p, path="/usr/sbin:/usr/bin") is None]
    return f"no {absent[0]} (apt-get install slurmctld slurmd slurm-client munge)" if absent \
        else None


def is_of_job(environment: list[bytes]) -> bool:
    return any(word.startswith(b"SLURM_JOB_ID=") for word in environment)


class SlurmNode:
    """Began when it is made; end() ends all of it."""

    def __init__(self, folder: pathlib.Path):
        self.folder = folder
        self.space = f"slurm{os.getpid()}"
        self.daemons = {}
        for name in ("state", "spool"):
            (folder / name).mkdir(parents=True)
        host = os.uname().nodename.split(".")[0]
        (folder / "slurm.conf").write_text(CONF.format(
            host=host, folder=folder, address=ADDRESS, cores=os.cpu_count()))
        is_new = pathlib.Path("/sys/fs/cgroup/cgroup.controllers").exists()
        (folder / "cgroup.conf").write_text(
            "CgroupPlugin=cgroup/v2\nIgnoreSystemd=yes\n" if is_new else "CgroupPlugin=cgroup/v1\n")
        self.settings = {"SLURM_CONF": str(folder / "slurm.conf")}
        self.environment = os.environ | self.settings
        subprocess.run(["ip", "netns", "add", self.space], check=True)
        try:
            for words in ("link set lo up", "link add wire type veth peer name other",
                          f"addr add {ADDRESS}/24 dev wire", "link set wire up",
                          "link set other up"):
                self.run(["ip", *words.split()], check=True)
            (folder / "munge.key").write_bytes(os.urandom(128))
            (folder / "munge.key").chmod(0o600)
            files = {"key-file": "munge.key", "socket": "munge.socket", "pid-file": "munge.pid",
                     "log-file": "munge.log", "seed-file": "munge.seed"}
            self.start("munged", "munged", "--foreground", "--force",
                       *(f"--{key}={folder / name}" for key, name in files.items()))
            self.wait(lambda: (folder / "munge.socket").exists(), "munged")
            self.start("slurmctld", "slurmctld", "-D")
            self.start_node()
        except BaseException:
            self.end()
            raise

    def inside(self, command: list) -> list:
        # Not `ip netns exec`, which would hide the control groups that slurmd looks for.
        return ["nsenter", f"--net=/run/netns/{self.space}", *map(str, command)]

    def run(self, command: list, **options) -> subprocess.CompletedProcess:
        """A command where the cluster is."""
        return subprocess.run(self.inside(command), timeout=300, capture_output=True, text=True,
                              env=options.pop("env", self.environment), **options)

    def start(self, name: str, *command):
        with open(self.folder / f"{name}.out", "ab") as output:
            self.daemons[name] = subprocess.Popen(
                self.inside(list(command)), env=self.environment, stdout=output, stderr=output,
                start_new_session=True)

    def start_node(self):
        self.start("slurmd", "slurmd", "-D")
        self.wait(lambda: self.run(["sinfo", "--noheader", "--format=%T"]).stdout.strip()
                  in ("idle", "mixed", "allocated"), "the node")

    def kill_node(self):
        """As if its plug was pulled: its daemon and all that it runs, without a word."""
        node = self.daemons.pop("slurmd")
        for pid in [*self.jobs(), node.pid]:
            try:
                os.kill(pid, 9)
            except ProcessLookupError:
                pass
        node.wait()

    def jobs(self) -> list[int]:
        """Processes of jobs: those that name this cluster's configuration and one of its jobs."""
        return self.find(lambda words, steps: steps or is_of_job(words))

    def programs(self) -> list[int]:
        """The same without Slurm's own, whose end would be the node's fault and not the job's."""
        return self.find(lambda words, steps: not steps and is_of_job(words))

    def find(self, is_wanted) -> list[int]:
        mark = f"SLURM_CONF={self.folder}/slurm.conf".encode()
        found = []
        for process in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                words = (process / "environ").read_bytes().split(b"\0")
                steps = (process / "cmdline").read_bytes().startswith(b"slurmstepd")
            except OSError:
                continue
            if mark in words and is_wanted(words, steps):
                found.append(int(process.name))
        return found

    def wait(self, is_there, what: str):
        deadline = time.monotonic() + WAIT_S
        while not is_there():
            assert time.monotonic() < deadline, f"{what} does not come up: see {self.folder}"
            time.sleep(0.1)

    def end(self):
        for pid in self.jobs():
            try:
                os.kill(pid, 9)
            except ProcessLookupError:
                pass
        for daemon in reversed(list(self.daemons.values())):
            daemon.terminate()
        for daemon in self.daemons.values():
            try:
                daemon.wait(timeout=20)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait()
        subprocess.run(["ip", "netns", "del", self.space], check=False)
