#!/usr/bin/env python3
"""What users read is plain technical English: no sentence above 35 words, no archaic or private words.

Read are messages, help texts and documentation of fields (the strings of core/ and server/), schema/openapi.json,
the texts of web/, the guide and every README. Code blocks and quoted programs do not count as sentences.
To forbid another word add a row to WORDS, with what to write instead."""

import ast
import html
import json
import os
import re
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

MAX_WORDS = 35

WORDS = {  # as regular expressions: what to write instead
    r"told|tells?|tellable|foretold|foretells?|retold|retells?": "report, state, show",
    r"whoever|whosoever|nobody|somebody": "a user, a client, no one who ...: name who it is",
    r"anew": "again",
    r"likewise": "the same for",
    r"whatever": "any, further",
    r"beside": "with, next to, in addition to",
    r"lest|ere|whence|thence|thereof|therein|wherein|hitherto|upon|amidst|forthwith|henceforth|nigh": "a usual word",
    r"(?:comes?|came) to(?! (?:an end|rest))": "results in, is",
    r"(?:lies?|lay) (?:in|within|below|above|between|outside|there)": "is",
    r"stands? (?:at|in|twice|beside|there|between|before|for)": "is, occurs, precedes, represents",
    r"(?:is|are) meant": "is expected",
    r"goes on|went on": "continues",
    r"as it stands|as they stand": "as printed, unchanged",
    r"what it says|what they say": "its contents",
    r"in its stead|or its like|and the like|or the like": "instead; similar",
    r"of yore|for ever|ever and again": "permanently",
    r"seats?|doorm[ae]n|journeys?|keepers?|crews?|houses?": "the standard term",
    r"cannot be made out": "is unknown",
}
FORBIDDEN = re.compile("|".join(rf"\b(?:{word})\b" for word in WORDS), re.I)

C_TOKEN = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:[^"\\\n]|\\.)*"|' r"'(?:[^'\\\n]|\\.)*'|\s+|PRI\w+|.", re.S)
NO_PROSE = re.compile(r"\s*(?:SELECT|INSERT|UPDATE|DELETE|CREATE|WITH|PRAGMA|BEGIN|FROM|WHERE|ORDER|DROP|ALTER)\b"
                      r"|\s*<style>|\}(?:\\n| )*\.\w+ \{|\.(?:SH|TP|PP|TH)\b")  # SQL, CSS, man(7)


def lines_before(text, position):
    return text.count("\n", 0, position) + 1


def c_strings(text):
    """Each text of a C file, neighbouring literals joined: (line, text)."""
    joined, line = None, 0
    for token in C_TOKEN.finditer(text):
        word = token.group()
        if word[0] == '"':
            if joined is None:
                joined, line = "", lines_before(text, token.start())
            joined += word[1:-1]
        elif not word.isspace() and not word.startswith(("//", "/*", "PRI")) and joined is not None:
            yield line, joined
            joined = None


def help_text(text):
    """A literal without its examples: lines that are indented, in texts of several lines."""
    lines = text.replace('\\"', '"').replace("\\t", " ").split("\\n")
    return "\n".join("" if len(lines) > 1 and line.startswith("  ") else line for line in lines)


def c_prose(path, text):
    for line, literal in c_strings(text):
        if " " in literal.strip() and not NO_PROSE.match(literal):
            yield f"{path}:{line}", help_text(literal)


def json_prose(path, node, place=""):
    if isinstance(node, dict):
        for key, value in node.items():
            if key in ("summary", "description", "title") and isinstance(value, str):
                yield f"{path} {place}/{key}", value
            else:
                yield from json_prose(path, value, f"{place}/{key}")
    elif isinstance(node, list):
        for index, value in enumerate(node):
            yield from json_prose(path, value, f"{place}/{index}")


def template(text, at):
    """The template whose text begins at `at`: its text with "X" for each expression, literals within these, its end."""
    parts, inner = [], []
    while at < len(text) and text[at] != "`":
        if text.startswith("${", at):
            found, at = literals(text, at + 2, "}")
            inner += found
            parts.append("X")
        else:
            width = 2 if text[at] == "\\" else 1
            parts.append(text[at:at + width])
            at += width
    return "".join(parts), inner, at + 1


def literals(text, at=0, end=None):
    """Quoted texts and templates of a script as (offset, text), comments left out, up to a bracket `end`; and where that is."""
    found, depth = [], 0
    while at < len(text):
        comment = re.compile(r"//[^\n]*|/\*.*?\*/", re.S).match(text, at)
        quoted = re.compile(r'"((?:[^"\\\n]|\\.)*)"').match(text, at)
        if comment:
            at = comment.end()
        elif quoted:
            found.append((at, quoted.group(1)))
            at = quoted.end()
        elif text[at] == "`":
            literal, inner, after = template(text, at + 1)
            found += [(at, literal), *inner]
            at = after
        elif end is not None and text[at] == end and depth == 0:
            return found, at + 1
        else:
            depth += {"{": 1, "}": -1}.get(text[at], 0)
            at += 1
    return found, at


def script_prose(path, text):
    """The quoted texts of a script and those between the tags of its markup; an expression within a template is one word."""
    for offset, literal in literals(text)[0]:
        for part in re.split(r"<[^<>]*>", re.sub(r"=>", "", literal)) if "<" in literal else [literal]:
            if " " in part.strip():
                yield f"{path}:{lines_before(text, offset)}", part


def html_prose(path, text):
    text = re.sub(r"<(script|style)\b.*?</\1>", lambda found: "\n" * found.group().count("\n"), text, flags=re.S)
    for found in re.finditer(r">([^<>]+)<", text):
        if " " in found.group(1).strip():
            yield f"{path}:{lines_before(text, found.start(1))}", html.unescape(found.group(1))


def markdown_prose(path, text):
    """Paragraphs, list items and cells of tables; code within a line is one word."""
    text = re.sub(r"^( *)(```|~~~).*?^\1\2 *$", lambda found: "\n" * found.group().count("\n"), text, flags=re.M | re.S)
    text = re.sub(r"<!--.*?-->", lambda found: "\n" * found.group().count("\n"), text, flags=re.S)
    block, first = [], 0
    for number, line in enumerate([*text.split("\n"), ""], 1):
        is_new = re.match(r"\s*(?:[-*+]|\d+\.)\s|#|>|\||\s*$", line) is not None
        is_code = re.match(r"(?: {4}|\t)", line) is not None and not block
        if (is_new or is_code) and block:
            yield f"{path}:{first}", markdown_plain(" ".join(block))
            block = []
        if is_code:
            continue
        if line.startswith("|"):
            for cell in line.strip().strip("|").split("|"):
                yield f"{path}:{number}", markdown_plain(cell)
        elif line.strip():
            if not block:
                first = number
            block.append(re.sub(r"^\s*(?:[-*+]|\d+\.|#+|>)\s+", "", line).strip())


def markdown_plain(text):
    text = re.sub(r"``[^`]*(?:`[^`]+)*``|`[^`]*`", "CODE", text)
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    return re.sub(r"https?://\S+", "LINK", text)


def lines_prose(path, text):
    for number, line in enumerate(text.split("\n"), 1):
        if not re.match(r"\S*\b(?:curl|impactd)\b|\w+=\$\(", line):  # of a shell
            yield f"{path}:{number}", line


def python_prose(path, text):
    """Documentation strings: those of the client are read in a shell."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)):
            documentation = ast.get_docstring(node)
            if documentation:
                prose = re.sub(r"^(?:\s{4,}|>>>).*$", "", documentation, flags=re.M)
                yield f"{path}:{getattr(node, 'lineno', 1)}", prose


def sources():
    """Paths of all files that users may read: those of four folders, and each README."""
    for folder, folders, files in os.walk(program.SOURCE):
        folders[:] = sorted(set(folders) - {"vendor", "node_modules", "build", ".git"})
        top = os.path.relpath(folder, program.SOURCE).split(os.sep)[0]
        for file in sorted(files):
            if top in ("core", "server", "schema", "web") or file.endswith(".md"):
                yield os.path.relpath(os.path.join(folder, file), program.SOURCE)


def prose():
    """Every text that users meet: (place, text)."""
    for path in sources():
        name = os.path.join(program.SOURCE, path)
        readers = {".c": c_prose, ".h": c_prose, ".js": script_prose, ".html": html_prose, ".md": markdown_prose,
                   ".py": python_prose, ".txt": lines_prose}
        reader = readers.get(os.path.splitext(path)[1])
        is_list = path.endswith("CMakeLists.txt")
        with open(name, encoding="utf-8") as file:
            if path == "schema/openapi.json":
                yield from json_prose(path, json.load(file))
            elif reader is not None and not is_list:
                yield from reader(path, file.read())


def sentences(text):
    """Parts between full stops, and between blank lines; "e.g." and numbers do not end one."""
    text = re.sub(r"\b(?:e\.g|i\.e|cf|vs|approx|Fig|Eq|No|Dr|St)\.", "X", text)
    for part in re.split(r"\n\s*\n", text):
        yield from re.split(r"(?<=[.!?])[\"')*_]*\s+", part)


def words_of(sentence):
    return [word for word in sentence.split() if re.search(r"\w", word)]


def faults(texts):
    for place, text in texts:
        for word in FORBIDDEN.findall(text):
            cure = next(cure for row, cure in WORDS.items() if re.fullmatch(row + ".*", word, re.I))
            yield f'{place}: "{word}": write: {cure}'
        for sentence in sentences(text):
            count = len(words_of(sentence))
            if count > MAX_WORDS:
                yield f"{place}: {count} words, at most {MAX_WORDS}: {' '.join(sentence.split())[:90]} ..."


def test_what_users_read():
    """Messages, help, documentation of fields, API, dashboard, guide and READMEs: plain words, short sentences."""
    texts = list(prose())
    assert len(texts) > 4000, len(texts)  # nothing was overlooked
    found = list(faults(texts))
    assert not found, f"{len(found)} places:\n" + "\n".join(found)


def test_the_rules_find_what_they_forbid():
    """A long sentence and each forbidden word are found in every kind of text; code is not read."""
    long = " ".join(["word"] * (MAX_WORDS + 1))
    assert len(list(faults([("x", long), ("x", long[5:]), ("x", "Made anew. It comes to this.")]))) == 3
    assert [text for _, text in c_prose("x", 'f("one " // no\n "two", \'"\', "SELECT a FROM b");')] == ["one two"]
    page = "# A title\n\n- an *item* with `told`\n  over two lines\n\n```sh\ntold anew\n```\n\n    anew told\n\n| a b | [c d](told) |\n"
    assert [text for _, text in markdown_prose("x", page)] == [
        "A title", "an *item* with CODE over two lines", " a b ", " c d "], list(markdown_prose("x", page))
    assert [text for _, text in script_prose("x", 'say("it is", `of ${x ? `a` : 1}`) // no "one two"')][:1] == ["it is"]
    assert [text for _, text in html_prose("x", "<p>so be <b>it now</b></p><script>a < b > c d</script>")] == ["so be ", "it now"]


if __name__ == "__main__":
    sys.exit(program.main(globals()))
