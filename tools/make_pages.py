#!/usr/bin/python3
"""Manual pages and completions for bash and zsh, made from what the programs themselves say of
their options: `swarmtalk-cli --describe` and its like, and the parsers of programs in Python.

    tools/make_pages.py [--build FOLDER]           writes packaging/pages
    tools/make_pages.py [--build FOLDER] --check   says what differs from what is there

Run it after a change of a command's options, and commit what it has written; a test compares.
"""
import argparse
import importlib.machinery
import importlib.util
import json
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGES = ROOT / "packaging/pages"
DATE = "2026-11-22"  # of the pages, by hand: a build must not depend on the clock
PROGRAMS = {"swarmtalk-cli": ("cli", 1), "swarmtalk-lab": ("lab", 1), "swarmtalkd": ("daemon", 8),
            "swarmtalk-view": ("view", 1)}
PYTHON = {"swarmtalk-suite": ("suite/swarmtalk-suite", "parse", 1),
          "swarmtalk-run": ("client_lib/python/swarmtalk.py", "main", 1)}
SECTIONS = {**{name: section for name, (_, section) in PROGRAMS.items()},
            **{name: section for name, (_, _, section) in PYTHON.items()}}
# Groups of commands that do something without a further word, too.
ALONE = {"kilobot calibrate"}
# Behind the options of a program, what its page says.
TRAILERS = {"swarmtalk-lab": "I -- COMMAND", "exec": "-- COMMAND", "run": "-- COMMAND"}


# ---- What the programs say ----------------------------------------------------------------------

def described(name, build):
    path = build / PROGRAMS[name][0] / name
    done = subprocess.run([path, "--describe"], capture_output=True, text=True, check=True,
                          env={"PATH": "/usr/bin:/bin"})
    return tidy(json.loads(done.stdout))


def tidy(command):
    """The types of values as all versions of CLI11 name them: words, FILE, or TEXT and its like."""
    for option in command["options"]:
        value = option["value"]
        words = re.search(r"\{([^}]*)\}", value)
        option["words"] = words.group(1).split(",") if words else []
        option["is_file"] = "FILE" in value.split(":")
        option["value"] = ("FILE" if option["is_file"] else "|".join(option["words"])
                           or value.split(":")[0])
        if option["positional"] == "FILE":
            option["is_file"] = True
    command["commands"] = [tidy(each) for each in command["commands"]]
    return command


class Captured(Exception):
    pass


def parser_of(name):
    """The ArgumentParser that a program in Python makes."""
    path, function, _ = PYTHON[name]
    original = argparse.ArgumentParser.parse_args

    def capture(self, *_arguments, **_options):
        raise Captured(self)

    argparse.ArgumentParser.parse_args = capture
    try:
        loader = importlib.machinery.SourceFileLoader(name.replace("-", "_"), str(ROOT / path))
        module = importlib.util.module_from_spec(
            importlib.util.spec_from_loader(loader.name, loader))
        loader.exec_module(module)
        getattr(module, function)([])
    except Captured as caught:
        return caught.args[0]
    finally:
        argparse.ArgumentParser.parse_args = original
    raise SystemExit(f"make_pages: {name} parses no arguments")


def of_parser(parser, name, text):
    options, commands = [], []
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            helps = {each.dest: each.help for each in action._choices_actions}
            commands = [of_parser(sub, each, helps.get(each, ""))
                        for each, sub in action.choices.items()]
            continue
        if action.help == argparse.SUPPRESS:
            continue
        takes_value = action.nargs != 0
        value = (action.metavar or (action.dest.upper() if action.option_strings else "TEXT"))
        about = f"{action.help} {action.dest}"
        is_file = bool(re.search(r"\b(file|folder|log|path)\b", about, re.I))
        text_of_help = (action.help or "") % {"default": action.default, "prog": parser.prog}
        options.append({
            "names": action.option_strings,
            "positional": "" if action.option_strings else action.dest.upper(),
            "value": value if takes_value else "", "repeated": action.nargs in ("*", "+"),
            "required": action.required, "default": "", "text": text_of_help,
            "words": [str(each) for each in action.choices or []],
            "is_file": is_file and takes_value or action.dest in ("script", "scenario")})
    return {"name": name, "aliases": [], "text": text, "footer": "", "options": options,
            "commands": commands}


def all_described(build):
    programs = {name: described(name, build) for name in PROGRAMS}
    for name in PYTHON:
        parser = parser_of(name)
        programs[name] = of_parser(parser, name, " ".join((parser.description or "").split()))
    return programs


# ---- Manual pages -------------------------------------------------------------------------------

def troff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return re.sub(r"(?m)^([.'])", r"\\&\1", text)


def option_line(option):
    names = ", ".join(f"\\fB{troff(each)}\\fR" for each in option["names"])
    value = f" \\fI{troff(option['value'])}\\fR" if option["value"] else ""
    return names + value


def words_of(command):
    """The words behind a command, in its synopsis."""
    line = []
    for option in command["options"]:
        if option["positional"]:
            word = f"\\fI{troff(option['positional'])}\\fR" + ("..." if option["repeated"] else "")
            line.append(word if option["required"] else f"[{word}]")
    return " ".join(line)


def option_list(command):
    lines = []
    for option in command["options"]:
        if "--help" in option["names"] or (option["positional"] and not option["text"]):
            continue
        what = option["text"]
        if option["default"]:
            what += f" (default: {option['default']})"
        head = option_line(option) if option["names"] else (
            f"\\fI{troff(option['positional'])}\\fR")
        lines += [".TP", head, troff(what or "see above") + "."]
    return lines


def subcommand_sections(command, before):
    lines = []
    for each in command["commands"]:
        words = " ".join(filter(None, [before + each["name"], ""]))
        if words in ALONE:
            lines += [f".SS \"{troff(words)}\"", troff(each["text"]) + "."]
        if each["commands"]:
            lines += subcommand_sections(each, words + " ")
            continue
        trailer = f" {troff(TRAILERS[each['name']])}" if words in TRAILERS else ""
        arguments = " " + words_of(each) if words_of(each) else ""
        lines += [f".SS \"{troff(words)}{arguments}{trailer}\"", troff(each["text"]) + "."]
        if each["aliases"]:
            lines.append("Also: " + troff(", ".join(each["aliases"])) + ".")
        lines += option_list(each)
    return lines


def man_page(name, program, programs):
    first = program["text"].split(":")[0].rstrip(".")
    lines = [f'.TH {troff(name.upper())} {SECTIONS[name]} {DATE} SwarmTalk',
             ".\\\" Made by tools/make_pages.py.", ".SH NAME",
             f"{troff(name)} \\- {troff(first[0].lower() + first[1:])}",
             ".SH SYNOPSIS", f".B {troff(name)}"]
    words = words_of(program)
    lines.append("[\\fIOPTION\\fR]..." + (" \\fICOMMAND\\fR [\\fIOPTION\\fR]..."
                                          if program["commands"] else "")
                 + (f" {words}" if words else ""))
    lines += [".SH DESCRIPTION", troff(program["text"]).rstrip(".") + ".", ".SH OPTIONS"]
    lines += option_list(program)
    if program["commands"]:
        lines += [".SH COMMANDS"] + subcommand_sections(program, "")
    footer = [line for line in program["footer"].strip().split("\n") if line]
    if footer:
        lines += [".SH NOTES", troff(footer[0])]
        for line in footer[1:]:
            lines += [".PP", troff(line)]
    others = [f".BR {troff(each)} ({SECTIONS[each]})" for each in sorted(programs) if each != name]
    lines += [".SH SEE ALSO"] + with_commas(others)
    return "\n".join(lines) + "\n"


def with_commas(lines):
    return [line + "," for line in lines[:-1]] + lines[-1:]


# ---- Completions --------------------------------------------------------------------------------

def walk(command, path=()):
    """All commands of a program, each with the words that lead to it."""
    yield path, command
    for each in command["commands"]:
        yield from walk(each, path + (each["name"],))


def function_name(name):
    return "_" + name.replace("-", "_")


def quoted(words):
    return "'" + " ".join(words) + "'"


def bash_completion(name, program):
    states, values, offers = [], [], []
    top = [each for option in program["options"] for each in option["names"]]
    for path, command in walk(program):
        key = " ".join(path)
        for each in command["commands"]:
            words = "|".join(f"'{key}:{word}'" for word in [each["name"]] + each["aliases"])
            states.append(f"      {words}) command='{' '.join(path + (each['name'],))}' ;;")
        for option in command["options"]:
            if not option["value"] or not option["names"]:
                continue
            where = "*" if not path else f"'{key}'"
            action = ("_filedir_or_files" if option["is_file"] else
                      f"words={quoted(option['words'])}" if option["words"] else ":")
            pattern = "|".join(f"{where}:{each}" for each in option["names"])
            values.append((bool(path), f"    {pattern}) {action} ;;", option["names"]))
        names = [each for option in command["options"] for each in option["names"]]
        has_files = any(o["positional"] and o["is_file"] for o in command["options"])
        words = [each["name"] for each in command["commands"]]
        if path == ("help",):
            words = [each["name"] for each in program["commands"]]
        offers.append(f"    '{key}') options={quoted(sorted(set(names + top)))} "
                      f"words={quoted(words)}{' files=1' if has_files else ''} ;;")
    value_names = sorted({each for _, _, names in values for each in names})
    values = [line.replace("_filedir_or_files", "files=1")
              for _, line, _ in sorted(values, key=lambda each: not each[0])]
    return f"""# Completion of {name} in bash. Made by tools/make_pages.py.
{function_name(name)}() {{
  local cur=${{COMP_WORDS[COMP_CWORD]}} prev=${{COMP_WORDS[COMP_CWORD - 1]}}
  local command='' options='' words='' files='' i word
  COMPREPLY=()
  for ((i = 1; i < COMP_CWORD; i++)); do
    word=${{COMP_WORDS[i]}}
    if [ "$word" = -- ]; then
      mapfile -t COMPREPLY < <(compgen -c -f -- "$cur")
      return
    fi
    case ${{COMP_WORDS[i - 1]}} in
      {'|'.join(value_names) or '--'}) continue ;;
    esac
    case "$command:$word" in
{chr(10).join(states) or '      :) ;;'}
    esac
  done
  case "$command:$prev" in
{chr(10).join(values) or '    :) ;;'}
    *)
      case $command in
{chr(10).join('    ' + line for line in offers)}
      esac
      case $cur in
        -*) words=$options files='' ;;
      esac
      ;;
  esac
  if [ -n "$files" ]; then
    compopt -o filenames 2>/dev/null
    mapfile -t COMPREPLY < <(compgen -f -- "$cur")
  else
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$cur")
  fi
}}
complete -F {function_name(name)} {name}
"""


def zsh_text(text):
    return re.sub(r"([\[\]:'\\])", lambda m: "'\\''" if m.group(1) == "'" else "\\" + m.group(1),
                  text)


def zsh_option(option):
    names = option["names"]
    value = ""
    if option["value"]:
        action = ("_files" if option["is_file"] else
                  f"({' '.join(option['words'])})" if option["words"] else " ")
        value = f":{zsh_text(option['value'])}:{action}"
    text = f"[{zsh_text(option['text'])}]{value}"
    if len(names) == 1:
        return f"'{names[0]}{text}'"
    return f"'({' '.join(names)})'{{{','.join(names)}}}'{text}'"


def zsh_arguments(command, indent, path, program):
    lines = [zsh_option(option) for option in command["options"] if option["names"]]
    if command["commands"] or path == ("help",):
        names = command["commands"] or program["commands"]
        words = " ".join(f"{each['name']}\\:\"{zsh_text(each['text'])}\"" for each in names)
        lines += [f"'1:command:(({words}))'", "'*::argument:->more'"]
    else:
        for option in command["options"]:
            if option["positional"]:
                action = "_files" if option["is_file"] else " "
                star = "*" if option["repeated"] else ""
                lines.append(f"'{star}:{zsh_text(option['positional'])}:{action}'")
    return f" \\\n{indent}  ".join(["_arguments -C"] + lines)


def zsh_function(command, indent, path, program):
    text = indent + zsh_arguments(command, indent, path, program) + "\n"
    if command["commands"]:
        text += f"{indent}case $line[1] in\n"
        for each in command["commands"]:
            names = "|".join([each["name"]] + each["aliases"])
            text += f"{indent}  {names})\n"
            text += zsh_function(each, indent + "    ", path + (each["name"],), program)
            text += f"{indent}    ;;\n"
        text += f"{indent}esac\n"
    return text


def zsh_completion(name, program):
    return (f"#compdef {name}\n# Made by tools/make_pages.py.\nlocal curcontext=$curcontext "
            f"state line\n" + zsh_function(program, "", (), program))


# ---- All of them --------------------------------------------------------------------------------

def pages(build):
    programs = all_described(build)
    found = {}
    for name, program in programs.items():
        found[PAGES / f"man/{name}.{SECTIONS[name]}"] = man_page(name, program, programs)
        found[PAGES / f"bash/{name}"] = bash_completion(name, program)
        found[PAGES / f"zsh/_{name}"] = zsh_completion(name, program)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build-test")
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    sys.dont_write_bytecode = True
    made = pages(options.build)
    there = set(PAGES.glob("*/*"))
    wrong = sorted(path for path in set(made) | there
                   if path not in made or path not in there or path.read_text() != made[path])
    if options.check:
        for path in wrong:
            print(f"{path.relative_to(ROOT)} is not what the programs say; run tools/make_pages.py")
        return 1 if wrong else 0
    for path in wrong:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path in made:
            path.write_text(made[path])
        else:
            path.unlink()
        print(f"{path.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
