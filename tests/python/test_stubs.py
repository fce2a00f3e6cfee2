"""The types for editors (swarmtalk-stubs) name what swarmtalk.py has, with the same parameters."""
import ast
import pathlib

import pytest
from daemons import CLIENT

import swarmtalk

pytestmark = pytest.mark.logic
SOURCE = ast.parse((pathlib.Path(CLIENT) / "swarmtalk.py").read_text())
STUBS = ast.parse((pathlib.Path(CLIENT) / "swarmtalk-stubs/__init__.pyi").read_text())
# The tables by which the daemon's answers are read.
TABLES = {"Neighbour": swarmtalk._NEIGHBOUR, "_Status": swarmtalk._STATUS, "_Link": swarmtalk._LINK,
          "_ChannelStatus": swarmtalk._CHANNEL, "_Program": swarmtalk._PROGRAM}


def signature(function):
    """The parameters of a function with their defaults, without types."""
    if "property" in map(ast.unparse, function.decorator_list):
        return "property"
    for each in ast.walk(function.args):
        if isinstance(each, ast.arg):
            each.annotation = None
    return ast.unparse(function.args)


def bound(target):
    """The names that an assignment binds."""
    return [each.id for each in ast.walk(target) if isinstance(each, ast.Name)]


def members(body):
    """What the body of a module or class defines: {name: parameters, "property" or "value"}."""
    found = {}
    for node in body:
        if isinstance(node, ast.FunctionDef):
            found[node.name] = signature(node)
            for each in ast.walk(node):
                if (isinstance(each, ast.Attribute) and isinstance(each.ctx, ast.Store)
                        and isinstance(each.value, ast.Name) and each.value.id == "self"):
                    found.setdefault(each.attr, "value")
        elif isinstance(node, ast.AnnAssign):
            found[node.target.id] = "value"
        elif isinstance(node, ast.Assign) and bound(node.targets[0]) == ["__slots__"]:
            found.update({each.value: "value" for each in ast.walk(node.value)
                          if isinstance(each, ast.Constant)})
        elif isinstance(node, ast.Assign):
            is_alias = isinstance(node.value, ast.Name) and node.value.id in found
            kind = (found[node.value.id] if is_alias else
                    "property" if "_Chosen(" in ast.unparse(node.value) else "value")
            found.update(dict.fromkeys(bound(node.targets[0]), kind))
    return found


def public(tree):
    """All public names of a module: "name", "Class.name", also of a class's private bases."""
    classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
    found = {name: kind for name, kind in members(tree.body).items()
             if name[0] != "_" or name == "__version__"}
    for name, node in classes.items():
        bases = [base.id for base in node.bases if isinstance(base, ast.Name)]
        inside = {}
        for base in bases:
            if base[0] == "_" and base in classes:
                inside.update(members(classes[base].body))
        inside.update(members(node.body))
        found.update({f"{name}.{member}": kind for member, kind in inside.items()
                      if name[0] != "_" and (member[0] != "_" or member == "__init__")})
    return found


def test_the_types_name_what_the_library_has_with_the_same_parameters():
    has, named = public(SOURCE), public(STUBS)
    for name, fields in (("Pose", swarmtalk.Pose._fields),
                         ("GatewayOrigin", swarmtalk.GatewayOrigin._fields)):
        assert has.pop(name) == "value", "a namedtuple"
        has.update({f"{name}.{field}": "value" for field in fields})
    call, = (node for node in ast.walk(SOURCE) if isinstance(node, ast.Call)
             and isinstance(node.func, ast.Name) and node.func.id == "HarvestedValue")
    has.update({f"HarvestedValue.{each.arg}": "value" for each in call.keywords})
    has.update({f"Neighbour.{name}": "value" for name, _, _ in TABLES["Neighbour"].values()})
    assert len(has) > 120 and "Client.advertise" in has and "Subscriber.within" in has
    assert named == has


@pytest.mark.parametrize("kind", TABLES)
def test_the_types_name_what_the_daemon_answers(kind):
    node, = (node for node in STUBS.body if isinstance(node, ast.ClassDef) and node.name == kind)
    assert list(members(node.body)) == [name for name, _, _ in TABLES[kind].values()]
