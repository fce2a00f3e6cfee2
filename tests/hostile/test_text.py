"""No control character, no change of direction and nothing invisible reaches a terminal, a log, a
metrics file or JSON, whoever sends it: the air, or a program with a name."""
import json

from conftest import needs_root
from raw_text import raw_characters, shown

pytestmark = needs_root
SECONDS = 4


def test_text_of_strangers_steers_no_terminal_and_no_log():
    printed = shown(SECONDS)
    raw = {name: raw_characters(output)[:5] for name, output in printed.items()}
    assert not any(raw.values()), raw
    # It was there, and is shown escaped.
    for name in ("sub 5", "sub 5 --json", "sub debug harvest", "harvest -W 6", "log -W 6"):
        assert b"\\u202e" in printed[name] or b"\\u009b" in printed[name], (name, printed[name])
    assert b"x\\' (pid 1" in printed["the log"], "a name cannot end its own quotes"
    for name, output in printed.items():
        if "--json" in name:
            for line in output.splitlines():
                if not line.startswith(b"swarmtalk-cli: "):  # on stderr
                    json.loads(line)
