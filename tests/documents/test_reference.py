"""The API reference is made, and a public name without a comment is an error."""
import os
import re
import shutil
import subprocess

import pytest
from blocks import BUILD, ROOT

pytestmark = pytest.mark.field


def doxygen(folder, language, source):
    """Runs the configuration that cmake wrote, on other sources and into another folder."""
    if shutil.which("doxygen") is None:
        pytest.skip("doxygen is missing: run tools/setup test")
    text = (BUILD / f"docs/Doxyfile.{language}").read_text()
    text = re.sub(r"OUTPUT_DIRECTORY += .*", f"OUTPUT_DIRECTORY = {folder}/out", text)
    text = re.sub(r"\nINPUT += .*", f"\nINPUT = {source}", text)
    (folder / "Doxyfile").write_text(text)
    return subprocess.run(["doxygen", folder / "Doxyfile"], capture_output=True, text=True,
                          timeout=120, env={**os.environ, "LC_ALL": "C"})


SOURCES = {"cpp": ROOT / "client_lib/include/swarmtalk",
           "python": ROOT / "client_lib/python/swarmtalk.py"}


@pytest.mark.parametrize("language", SOURCES)
def test_it_is_made_without_a_warning_and_without_the_network(language, tmp_path):
    done = doxygen(tmp_path, language, SOURCES[language])
    assert (done.returncode, done.stderr) == (0, "")
    pages = {page.name: page.read_text() for page in (tmp_path / "out").glob("*.html")}
    names = {"cpp": ["swarmtalk::Client", "set_fixed_pose", "swarmtalk_send", "kChannelConflict"],
             "python": ["swarmtalk.Client", "set_fixed_pose", "known_distance_only", "Robot"]}
    for name in names[language]:
        assert any(name in page for page in pages.values()), name
    assert "_Session" not in "".join(pages.values())
    loaded = re.findall(r'(?:src|href)="(https?://[^"]+)"', "".join(pages.values()))
    assert set(loaded) <= {"https://www.doxygen.org/index.html"}, "only the link to Doxygen itself"


def test_a_name_without_a_comment_is_an_error(tmp_path):
    source = tmp_path / "swarmtalk"
    shutil.copytree(SOURCES["cpp"], source)
    header = source / "client/message.hpp"
    text = header.read_text()
    comment = "  /// Whether the distance is known.\n"
    assert comment in text
    header.write_text(text.replace(comment, ""))
    done = doxygen(tmp_path, "cpp", source)
    assert done.returncode != 0 and "has_distance() const (function)" in done.stderr, done.stderr
