"""What a Wi-Fi guest boots: Debian's kernel and an initramfs with the modules that simulated radios
need. Nothing is installed: the kernel is the machine's own where that is Debian's, else its package
is downloaded and read once (cache: $XDG_CACHE_HOME/swarmtalk/wifi, some 30 MB).

The initramfs holds busybox, modules and `init`; all else the guest reads from the machine's own
file system, which it sees but cannot write (init, guest_agent.py).
"""
import fcntl
import io
import lzma
import os
import pathlib
import re
import shlex
import shutil
import stat
import subprocess
import tarfile

HERE = pathlib.Path(__file__).resolve().parent
PACKAGE = "linux-image-amd64"
DOWNLOAD_TIMEOUT_S = 600
# In the order in which they are loaded, each behind what it depends on.
MODULES = ("virtio_pci", "virtio_console", "9pnet_virtio", "9p", "overlay", "mac80211_hwsim")
# Ciphers are asked for by name when a key is set, which nobody in the guest could answer: those
# that this kernel has as modules are loaded before. The others it has built in.
CIPHERS = ("ccm", "ctr", "aes_generic", "cmac", "gcm")
# Folders of the kernel's package that may hold one of them or of Guest(modules=...).
FOLDERS = re.compile(r"\./(usr/)?lib/modules/[^/]+/kernel/"
                     r"(net/|crypto/|arch/x86/crypto/|lib/|fs/(9p|netfs|fscache|overlayfs)/"
                     r"|drivers/(virtio|char)/"
                     r"|drivers/net/(veth|dummy|ifb|macvlan|bonding|wireless/))")
WIRELESS = re.compile(r"drivers/net/wireless/(?!(virtual/)?mac80211_hwsim)")


class Unavailable(Exception):
    """One line: what a guest needs that this machine does not have, and how to get it."""


def module_name(path) -> str:
    return pathlib.Path(path).name.split(".ko")[0].replace("-", "_")


def is_module(path: str) -> bool:
    return re.search(r"\.ko(\.xz)?$", path) is not None


class Kernel:
    """A kernel image and the folder that its modules are in."""

    def __init__(self, image: pathlib.Path, modules: pathlib.Path):
        self.image = image
        self.modules = {module_name(path): path for path in modules.rglob("*.ko*")
                        if is_module(path.name)}

    def read(self, name: str) -> bytes:
        """A module's file. @raises Unavailable when this kernel has none of that name."""
        path = self.modules.get(name)
        if path is None:
            raise Unavailable(f"{self.image.name} has no module {name}")
        content = path.read_bytes()
        return lzma.decompress(content) if path.name.endswith(".xz") else content

    def in_order(self, names) -> dict[str, bytes]:
        """These modules and all that they depend on, each behind what it needs."""
        found = {}

        def add(name, depth=0):
            name = name.replace("-", "_")
            if name in found or depth > 20:
                return
            content = self.read(name)
            depends = re.search(rb"\0depends=([^\0]*)\0", content)
            for other in (depends[1].decode().split(",") if depends and depends[1] else ()):
                add(other, depth + 1)
            found[name] = content

        for name in names:
            add(name)
        return found


def installed() -> Kernel | None:
    """The newest kernel of this machine that is Debian's for amd64 and has simulated radios."""
    for image in sorted(pathlib.Path("/boot").glob("vmlinuz-*-amd64"), reverse=True):
        modules = pathlib.Path("/lib/modules") / image.name[len("vmlinuz-"):]
        if os.access(image, os.R_OK) and any(modules.rglob("mac80211_hwsim.ko*")):
            return Kernel(image, modules)
    return None


def cache_folder() -> pathlib.Path:
    base = os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache"
    return pathlib.Path(base) / "swarmtalk/wifi"


def unpack(package: pathlib.Path, folder: pathlib.Path):
    """The image, and the modules that a guest may load, out of a kernel's package."""
    reader = subprocess.Popen(["dpkg-deb", "--fsys-tarfile", package], stdout=subprocess.PIPE)
    with tarfile.open(fileobj=reader.stdout, mode="r|") as files:
        for entry in files:
            is_image = entry.name.startswith("./boot/vmlinuz-")
            wanted = FOLDERS.match(entry.name) and is_module(entry.name) \
                and not WIRELESS.search(entry.name)
            if entry.isfile() and (is_image or wanted):
                place = folder / ("vmlinuz" if is_image else "modules/" + entry.name.split("/")[-1])
                place.parent.mkdir(parents=True, exist_ok=True)
                place.write_bytes(files.extractfile(entry).read())
    if reader.wait() != 0:
        raise Unavailable(f"{package.name} cannot be unpacked")


def download(folder: pathlib.Path):
    """The newest kernel of the machine's package sources, unpacked into `folder`."""
    for program in ("apt-get", "apt-cache", "dpkg-deb"):
        if shutil.which(program) is None:
            raise Unavailable(f"no {program} here to get Debian's kernel with")
    listed = subprocess.run(["apt-cache", "depends", "--important", PACKAGE], capture_output=True,
                            text=True, timeout=60)
    names = re.findall(r"Depends: (linux-image-\S+)", listed.stdout)
    if not names:
        raise Unavailable(f"no package {PACKAGE} in this machine's sources (apt-get update?)")
    folder.mkdir(parents=True)
    done = subprocess.run(["apt-get", "-qq", "download", names[0]], cwd=folder, text=True,
                          capture_output=True, timeout=DOWNLOAD_TIMEOUT_S)
    packages = list(folder.glob("*.deb"))
    if done.returncode != 0 or not packages:
        last = (done.stderr.strip().splitlines() or ["no reason given"])[-1]
        raise Unavailable(f"apt-get download {names[0]}: {last}")
    unpack(packages[0], folder)
    packages[0].unlink()


def find_kernel() -> Kernel:
    """@raises Unavailable when there is none and none can be downloaded."""
    own = installed()
    if own is not None:
        return own
    folder = cache_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = open(folder / "lock", "w", encoding="ascii")
    except OSError as error:
        raise Unavailable(f"{folder}: {error.strerror}") from error
    with lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / "kernel/vmlinuz").exists():
            part = folder / "kernel.part"
            shutil.rmtree(part, ignore_errors=True)
            try:
                download(part)
                part.rename(folder / "kernel")
            finally:
                shutil.rmtree(part, ignore_errors=True)
    return Kernel(folder / "kernel/vmlinuz", folder / "kernel/modules")


def find_busybox() -> pathlib.Path:
    """busybox, linked statically: it runs before any library can be read."""
    for name in ("/bin/busybox", "/usr/bin/busybox"):
        path = pathlib.Path(name)
        if path.exists() and b"/ld-linux" not in path.read_bytes():
            return path
    raise Unavailable("no static busybox (apt-get install busybox-static)")


def missing() -> str | None:
    """Why no guest can boot here, as far as that can be said without trying; None: nothing."""
    for program, package in (("qemu-system-x86_64", "qemu-system-x86"), ("iw", "iw"),
                             ("ip", "iproute2"), ("hostapd", "hostapd"),
                             ("wpa_supplicant", "wpasupplicant")):
        if shutil.which(program, path=os.environ.get("PATH", "") + ":/usr/sbin:/sbin") is None:
            return f"no {program} (apt-get install {package})"
    try:
        find_busybox()
        find_kernel()
    except Unavailable as reason:
        return str(reason)
    return None


class Archive:
    """A cpio archive as the kernel reads it: format newc, Documentation/driver-api/early-userspace/
    buffer-format.rst."""

    def __init__(self):
        self.out = io.BytesIO()
        self.count = 0

    def add(self, name: str, mode: int, content: bytes = b"", device=(0, 0)):
        self.count += 1
        fields = (self.count, mode, 0, 0, 1, 0, len(content), 0, 0, *device, len(name) + 1, 0)
        self.out.write(b"070701" + b"".join(b"%08x" % field for field in fields))
        self._padded(name.encode() + b"\0", len(b"070701") + 8 * len(fields))
        self._padded(content)

    def _padded(self, content: bytes, before: int = 0):
        self.out.write(content + b"\0" * (-(before + len(content)) % 4))

    def folder(self, name: str):
        self.add(name, stat.S_IFDIR | 0o755)

    def finish(self) -> bytes:
        self.add("TRAILER!!!", 0)
        return self.out.getvalue()


def initramfs(kernel: Kernel, settings: dict[str, str], modules=()) -> bytes:
    """@param settings  what `init` finds as variables of its shell; names of capitals
    @param modules   more modules, loaded behind the usual ones"""
    archive = Archive()
    for name in ("bin", "dev", "proc", "sys", "modules", "host", "writes", "root"):
        archive.folder(name)
    archive.add("dev/console", stat.S_IFCHR | 0o600, device=(5, 1))
    archive.add("bin/busybox", stat.S_IFREG | 0o755, find_busybox().read_bytes())
    archive.add("bin/sh", stat.S_IFLNK | 0o777, b"busybox")
    archive.add("init", stat.S_IFREG | 0o755, (HERE / "init").read_bytes())
    text = "".join(f"{name}={shlex.quote(value)}\n" for name, value in settings.items())
    archive.add("settings", stat.S_IFREG | 0o644, text.encode())
    ciphers = [name for name in CIPHERS if name in kernel.modules]
    ordered = kernel.in_order((*MODULES[:-1], *ciphers, *modules, MODULES[-1]))
    for number, (name, content) in enumerate(ordered.items()):
        archive.add(f"modules/{number:03}-{name}.ko", stat.S_IFREG | 0o644, content)
    return archive.finish()
