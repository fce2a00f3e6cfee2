"""The folder of a sweep: what it is of, its simulators, and a file for each finished run.

A file is there whole or not at all, whenever and however the sweep is ended: it is written under
another name, brought to the disk, and renamed. Several machines may write here at once, each the
runs that were given to it.
"""
import collections
import errno
import fcntl
import json
import os
import pathlib

from sweep import SweepError

FORMAT = 1


def write_whole(path: pathlib.Path, content: bytes):
    """Raises SweepError, with nothing left behind, when it does not fit."""
    part = path.with_name(f".{path.name}.{os.uname().nodename}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with open(part, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except OSError as error:
        try:
            part.unlink(missing_ok=True)
        except OSError:
            pass  # the first error is the one to tell
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise SweepError(f"{path.parent}: no space left; finished runs are kept: make room and "
                             "give the same command again") from error
        raise SweepError(f"{path}: {error.strerror}") from error


class Store:
    """One sweep's folder."""

    def __init__(self, folder: pathlib.Path, plan):
        self.folder, self.plan = folder, plan
        self.runs = folder / "runs"
        self.damaged = 0  # files that hold no result: their runs are done again
        self.simulators_ = {}  # cell's number: path in programs/
        self._lock = None

    def open(self, file: pathlib.Path) -> bool:
        """Looks at the folder and changes nothing. @return whether nothing has begun there; mark()
        begins it. Raises SweepError when it is another sweep's."""
        mark = self.folder / "sweep.json"
        if not mark.exists():
            if self.folder.exists() and not self.folder.is_dir():
                raise SweepError(f"{self.folder} is not a folder; name another with --folder")
            if self.folder.exists() and not all(self._is_beginning(e.name)
                                                for e in self.folder.iterdir()):
                raise SweepError(f"{self.folder} is there and is not a sweep's folder; name "
                                 "another with --folder")
            return True
        try:
            found = json.loads(mark.read_text(encoding="utf-8"))
            identity, name, version = found["identity"], found["file"], found["format"]
        except (ValueError, KeyError, TypeError, OSError) as error:
            raise SweepError(f"{mark} is not what a sweep writes; name another folder with "
                             "--folder") from error
        is_same = version == FORMAT and identity == self.plan.identity()
        if not is_same and (version != FORMAT or any(self.runs.glob("*/*"))):
            raise SweepError(f"{self.folder} holds another sweep ({name}, as it was then); "
                             "name another folder with --folder, or remove this one")
        return not is_same

    @staticmethod
    def _is_beginning(name: str) -> bool:
        """Of a file that a sweep leaves which was ended before its folder was begun."""
        return name in ("lock", "sweep.toml") or name.startswith((".sweep.toml.", ".sweep.json."))

    def mark(self, file: pathlib.Path):
        """Begins the folder, or takes over other numbers of runs, for jobs on other machines to
        see. Only with the lock, or another sweep at work would have its file changed."""
        content = {"format": FORMAT, "identity": self.plan.identity(), "file": str(file)}
        for name, wanted in (("sweep.toml", self._given(file)),
                             ("sweep.json", (json.dumps(content, indent=1) + "\n").encode())):
            path = self.folder / name
            if not path.exists() or path.read_bytes() != wanted:
                write_whole(path, wanted)

    @staticmethod
    def _given(file: pathlib.Path) -> bytes:
        try:
            return file.read_bytes()
        except OSError as error:
            raise SweepError(f"{file}: {error.strerror}") from error

    def lock(self):
        """Until this process ends. Raises SweepError when another one works here."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._lock = open(self.folder / "lock", "w", encoding="utf-8")
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise SweepError(f"another sweep is at work in {self.folder}; wait until it has ended, "
                             "or end it") from error
        except OSError as error:
            raise SweepError(f"{self.folder}/lock: {error.strerror}") from error

    def simulators(self) -> dict[int, str]:
        """Which each cell began with; empty before the first run."""
        path = self.folder / "simulators.json"
        if not path.exists():
            return {}
        try:
            found = {int(k): v for k, v in json.loads(path.read_text(encoding="utf-8")).items()}
            return found if all((self.folder / "programs" / each).exists()
                                for each in found.values()) else {}
        except (ValueError, AttributeError):
            return {}

    def keep_simulators(self, found: dict[int, str]):
        """Raises SweepError when runs are there that others have made."""
        path = self.folder / "simulators.json"
        content = (json.dumps(found, indent=0) + "\n").encode()
        if path.exists() and path.read_bytes() != content and any(self.runs.glob("*/*.json")):
            raise SweepError(f"{self.folder}/programs has lost simulators that finished runs were "
                             "made with, and the sources have changed since: begin in another "
                             "folder with --folder")
        write_whole(path, content)

    def simulator(self, cell) -> pathlib.Path | None:
        name = self.simulators_.get(cell.number)
        return self.folder / "programs" / name if name else None

    def path(self, cell, run: int) -> pathlib.Path:
        return self.runs / f"{cell.number:05}" / f"{run}.json"

    def put(self, cell, run: int, result: dict, cpu_s: float):
        """A finished run. @param result  of metrics.evaluate"""
        content = {"cell": cell.number, "seed": cell.seed(run), "result": result, "cpu_s": cpu_s}
        write_whole(self.path(cell, run), (json.dumps(content) + "\n").encode())

    def begin(self, cell, run: int):
        """A run in real time that must not be done twice has begun."""
        write_whole(self.path(cell, run).with_suffix(".begun"), b"")

    def forget(self, cell, run: int):
        """It did not come to be."""
        self.path(cell, run).with_suffix(".begun").unlink(missing_ok=True)

    def scan(self) -> dict[int, dict]:
        """{cell's number: {run: result}}; the result is None of a run in real time that was cut
        off."""
        found = collections.defaultdict(dict)
        self.damaged = 0
        for cell in self.plan.cells:
            try:
                entries = list(os.scandir(self.runs / f"{cell.number:05}"))
            except FileNotFoundError:
                continue
            begun = []
            for entry in entries:
                stem, dot, kind = entry.name.partition(".")
                if not stem.isdigit():
                    continue  # a part that a killed process left
                run = int(stem)
                if kind == "begun":
                    begun.append(run)
                elif kind == "json":
                    result = self._read(entry.path, cell, run)
                    if result is not None:
                        found[cell.number][run] = result
                    elif cell.is_real_time:
                        begun.append(run)
            for run in begun:
                found[cell.number].setdefault(run, None)
        return found

    def read(self, cell, run: int) -> dict | None:
        """A finished run's figures; None if there are none."""
        return self._read(str(self.path(cell, run)), cell, run)

    def _read(self, path: str, cell, run: int) -> dict | None:
        try:
            with open(path, "rb") as file:
                content = json.loads(file.read())
            if content["cell"] == cell.number and content["seed"] == cell.seed(run) \
                    and isinstance(content["result"], dict):
                return content["result"]
        except (ValueError, KeyError, TypeError):
            pass
        self.damaged += 1
        return None
