#!/usr/bin/python3
"""Doxygen's filter (docs/Doxyfile.in): prints a header, or the Python file, with its comments as
Doxygen reads them, and without what is no business of a program.

Headers: the comment at the top is the file's; one behind a declaration belongs to it, one above to
what follows. A plain member without a comment is one whose name says all. Python: public classes,
functions and attributes with their docstrings."""
import ast
import re
import sys

TRAILING = re.compile(r"^(.*[;,]|\s*\w[\w =]*|\s*#define \w+ \S+)(\s+)"
                      r"(?://(?!/)\s?(.*)|/\* (.*) \*/)$")
ALONE = re.compile(r"^(\s*)//(?!/)\s?(.*)$")
MEMBER = re.compile(r"^\s+(?!return|using|friend|typedef|public|private)[\w:<>,*& ]+[ *&](\w+)"
                    r"(?: = [^;()]*|\{[^;()]*\})?;$")
UNINTERESTING = re.compile(r"= (?:default|delete);$|&&\)( noexcept)?;$|^\s*friend |"
                           r"^#define SWARMTALK_(API|LOOK|NODISCARD)\b")


def top_comment(lines):
    """The comment at the top of a header, as the file's, and the lines behind it."""
    end = 0
    if lines[0].startswith("/*"):
        while "*/" not in lines[end]:
            end += 1
        end += 1
        text = [re.sub(r"^/?\*+/? ?|^ \* ?|\s*\*/$", "", line) for line in lines[:end]]
    else:
        while lines[end].startswith("//"):
            end += 1
        text = [line[2:].lstrip() for line in lines[:end]]
    return ["/// @file"] + ["/// " + line for line in text], lines[end:]


def header(lines):
    top, lines = top_comment(lines)
    yield from top
    column = None  # of a trailing comment that may go on in the next line
    end = None  # of a friend's body
    for line in lines:
        if end is not None or re.match(r"\s*friend .*\{$", line):
            end = None if line == end else end or re.match(r"\s*", line).group() + "}"
            yield ""
            continue
        alone, trailing = ALONE.match(line), TRAILING.match(line)
        member = MEMBER.match(line)
        if UNINTERESTING.search(line):
            yield ""
        elif trailing and not alone:
            column = len(trailing.group(1) + trailing.group(2))
            text = trailing.group(3) if trailing.group(3) is not None else trailing.group(4)
            yield f"{trailing.group(1)}  ///< {text}"
            continue
        elif alone and column is not None and len(alone.group(1)) == column:
            yield f"{alone.group(1)}///< {alone.group(2)}"
            continue
        elif alone:
            yield f"{alone.group(1)}/// {alone.group(2)}"
        elif member:
            yield f"{line}  ///< \\c {member.group(1)}"
        else:
            yield re.sub(r"^(\s*)/\* ", r"\1/** ", line)
        column = None


def arguments(node):
    return ast.unparse(node.args)


def attributes(constructor, lines):
    """Public variables that __init__ makes: [(name, comment behind or above it)]."""
    for node in ast.walk(constructor):
        for target in getattr(node, "targets", []):
            if isinstance(target, ast.Attribute) and not target.attr.startswith("_"):
                behind = re.search(r"  # (.*)$", lines[node.lineno - 1])
                above = re.match(r"\s*# (.*)$", lines[node.lineno - 2])
                comment = behind or above
                yield target.attr, comment.group(1) if comment else ""


def docstring(node, indent):
    text = ast.get_docstring(node)
    if not text:
        return []
    return [indent + "##"] + [f"{indent}# {line}".rstrip() for line in text.splitlines()]


def members(node, lines):
    """The public functions and attributes of a class."""
    for each in node.body:
        if not isinstance(each, ast.FunctionDef):
            continue
        if each.name == "__init__":
            for name, comment in attributes(each, lines):
                yield from ([f"    ## {comment}"] if comment else [])
                yield f"    {name} = None\n"
        elif not each.name.startswith("_"):
            yield from docstring(each, "    ")
            is_property = any(getattr(one, "id", "") == "property" for one in each.decorator_list)
            yield (f"    {each.name} = None\n" if is_property
                   else f"    def {each.name}({arguments(each)}):\n        pass\n")


def python(text):
    """A skeleton: Doxygen's own reading of Python makes private names public. What a private base
    class has belongs to the public one."""
    lines = text.splitlines()
    module = ast.parse(text)
    classes = {each.name: each for each in module.body if isinstance(each, ast.ClassDef)}
    yield from docstring(module, "")
    for node in module.body:
        if getattr(node, "name", "_").startswith("_"):
            continue
        yield from docstring(node, "")
        if isinstance(node, ast.FunctionDef):
            yield f"def {node.name}({arguments(node)}):\n    pass\n"
            continue
        bases = [ast.unparse(base) for base in node.bases]
        shown = [base for base in bases if not base.startswith("_")]
        yield f"class {node.name}({', '.join(shown)}):\n    pass\n"
        yield from members(node, lines)
        for base in bases:
            if base.startswith("_") and base in classes:
                yield from members(classes[base], lines)


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        text = file.read()
    lines = python(text) if sys.argv[1].endswith(".py") else header(text.splitlines())
    print("\n".join(lines))


if __name__ == "__main__":
    main()
