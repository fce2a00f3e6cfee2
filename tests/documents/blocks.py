"""The code blocks of the documents, and where our programs are."""
import os
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("SWARMTALK_BUILD", ROOT / "build-test")).resolve()
PROGRAMS = {"swarmtalk-cli": BUILD / "cli/swarmtalk-cli", "swarmtalk-lab": BUILD /
            "lab/swarmtalk-lab", "swarmtalkd": BUILD / "daemon/swarmtalkd"}


def blocks(document, language):
    """[(text before it, block)] of one language, indentation taken off."""
    text = (ROOT / document).read_text(encoding="utf-8")
    found = []
    for match in re.finditer(rf"^( *)```{language}\n(.*?)^ *```", text, re.S | re.M):
        block = re.sub(rf"^{match.group(1)}", "", match.group(2), flags=re.M)
        found.append((text[:match.start()], block))
    return found


def documents():
    return ["README.md", "CONTRIBUTING.md"] + sorted(
        str(path.relative_to(ROOT)) for path in (ROOT / "docs").glob("*.md"))
