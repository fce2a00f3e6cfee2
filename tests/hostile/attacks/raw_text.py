"""What must never reach a terminal, a log or a metrics file raw: found in what the programs and the
daemon print while bad_text.py and bad_names.py are at work. shown() collects it."""
import subprocess
import sys
import unicodedata

from conftest import program, wait_for
from stranger import ATTACKS, Air, counter

CHANNEL = 5
CONFIG = ('[node]\nid = 1\n[reserved]\ndebug = true\nharvest = true\nreport = true\n'
          '[links.w]\ntype = "raw_l2"\ninterface = "a0"\n[log]\nclient = "debug"\n')


def raw_characters(output):
    """All that steers a terminal, changes a direction or is invisible, and bytes that are no UTF-8;
    newlines and the tabs of tables are not. @param output  bytes"""
    text = output.decode("utf-8", errors="surrogateescape")
    return [f"{ord(each):04x}" for each in text if each != "\n" and
            (unicodedata.category(each) in ("Cc", "Cf", "Zl", "Zp", "Cs", "Co"))]


def commands(robot):
    """Views that end by themselves, from the robot's namespace."""
    cli = ["ip", "netns", "exec", robot.namespace, program("swarmtalk-cli"), "--socket",
           robot.socket]
    for words in ("status", "stats", "status --json", "stats --json", "channels -W 6",
                  "channels -W 6 --json", "neighbours", "neighbours --json", "metrics",
                  "harvest -W 6", "harvest -W 6 --json", "hz 5 -C 1", "top --once", "radar --once",
                  "doctor", "log -W 6", "log -W 6 --json", "sub --all -W 6"):
        yield words, [*cli, *words.split()]


def shown(seconds):
    """Runs both attacks, for so long and until all programs have ended. @return what each printed
    meanwhile, by name, as bytes"""
    with Air() as air:
        robot = air.robot("a").start(CONFIG)
        views = {words: robot.listen(*words.split(), file=True) for words in
                 ("sub 5", "sub 5 --json", "sub debug harvest")}
        numbers = {entry["name"]: entry["number"] for entry in robot.status()["channels"]}
        local = air.keep(subprocess.Popen(
            [sys.executable, "-B", str(ATTACKS / "bad_names.py"), robot.socket],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True))
        assert local.stdout.readline()
        attack = air.begin("bad_text", "--channel", CHANNEL, "--debug", numbers["debug"],
                           "--harvest", numbers["harvest"], "--rate", 50, "--seconds", 120)
        wait_for(lambda: counter(robot, "frames_received") > 20, what="frames",
                 timeout=60)
        looking = {words: air.keep(subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL))
            for words, command in commands(robot)}
        printed = {words: each.communicate(timeout=60)[0] for words, each in looking.items()}
        wait_for(lambda: counter(robot, "frames_received") >= 50 * seconds, what="all frames",
                 timeout=60)
        attack.kill()
        for words, view in views.items():
            view.terminate()
            _, errors = view.communicate(timeout=60)
            view.file.seek(0)
            printed[words] = view.file.buffer.read() + errors.encode()
        local.communicate("", timeout=60)
        wait_for(lambda: len(robot.status()["clients_served"]) == 1, what="the names' end",
                 timeout=60)
        with open(robot.log, "rb") as file:
            printed["the log"] = file.read()
        return printed
