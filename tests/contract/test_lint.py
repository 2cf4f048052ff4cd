#!/usr/bin/env python3
"""A linter of OpenAPI 3.1 finds no error in schema/openapi.json, and the dashboard's code keeps its rules.

Both are installed by npm into the build folder, once; without npm or its network the tests are skipped."""

import json
import os
import shutil
import subprocess
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

WAITS = True  # for npm's network

LINTER = "@redocly/cli@1.34.5"
FORMATTER = "prettier@3.10.1"

# Warnings that are meant to be there: rule -> why.
EXPECTED = {
    "no-ambiguous-paths": "{slug}@{revision} and {slug}: a slug holds no @",
    "operation-4xx-response": "examples, health and version take nothing that could be wrong",
    "operation-2xx-response": "/problems/{name} redirects to the guide",
    "no-path-trailing-slash": "/guide/ is a folder: its relative links need the slash",
}


def installed(package, name):
    """The path of a program of npm."""
    folder = os.path.join(program.build, "node")
    path = os.path.join(folder, "node_modules", ".bin", name)
    if os.path.exists(path):
        return path
    if shutil.which("npm") is None:
        raise program.Skipped("npm is not here (Debian packages nodejs and npm)")
    os.makedirs(folder, exist_ok=True)
    done = subprocess.run(["npm", "install", "--no-save", "--no-package-lock", "--no-audit", "--no-fund",
                           "--omit-lockfile-registry-resolved", "--loglevel=error", LINTER, FORMATTER],
                          cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    if done.returncode != 0:
        raise program.Skipped(f"npm cannot install {package}: {done.stderr.strip().splitlines()[-1:]}")
    return path


def lint(document):
    """The linter's findings as (severity, rule, message), with the schemas that the daemon serves beside the document."""
    folder = os.path.join(program.build, "node", "document")
    os.makedirs(folder, exist_ok=True)
    text = json.dumps(document)
    for name in os.listdir(os.path.join(program.SOURCE, "schema")):
        if name.endswith(".schema.json"):
            shutil.copy(os.path.join(program.SOURCE, "schema", name), folder)
            text = text.replace(f'"/schemas/{name.split(".")[0]}"', f'"./{name}"')
    with open(os.path.join(folder, "openapi.json"), "w", encoding="utf-8") as file:
        file.write(text)
    done = subprocess.run([installed(LINTER, "redocly"), "lint", "--format=json", "--extends=recommended", "--max-problems=1000", "openapi.json"],
                          cwd=folder, capture_output=True, text=True, timeout=200, check=False,
                          env={**os.environ, "REDOCLY_TELEMETRY": "off", "CI": "1"})
    assert done.stdout.startswith("{"), done
    return [(one["severity"], one["ruleId"], one["message"]) for one in json.loads(done.stdout)["problems"]]


def document():
    with open(os.path.join(program.SOURCE, "schema", "openapi.json"), encoding="utf-8") as file:
        return json.load(file)


def test_the_linter_finds_no_error():
    """Nothing but what is expected."""
    installed(LINTER, "redocly")
    found = [one for one in lint(document()) if one[1] not in EXPECTED]
    assert not found, "\n".join(map(str, found))


def test_the_linter_finds_planted_faults():
    """A reference that leads nowhere, an operation id used twice and a path without its parameter are found."""
    installed(LINTER, "redocly")
    broken = document()
    broken["paths"]["/v1/jobs"]["get"]["operationId"] = broken["paths"]["/version"]["get"]["operationId"]
    broken["paths"]["/v1/jobs/{id}"]["get"]["parameters"] = []
    broken["paths"]["/version"]["get"]["responses"]["200"]["content"]["application/json"]["schema"]["$ref"] += "x"
    rules = {rule for severity, rule, _ in lint(broken) if severity == "error"}
    assert rules >= {"operation-operationId-unique", "path-parameters-defined", "no-unresolved-refs"}, rules


def modules():
    """Every module of the dashboard, and that of the guide."""
    found = sorted(os.path.join(folder, name) for folder, _, names in os.walk(os.path.join(program.SOURCE, "web", "js"))
                   for name in names)
    assert len(found) > 50, found
    return [*found, os.path.join(program.SOURCE, "web", "guide", "guide.js")]


def test_the_dashboard_is_formatted():
    """Every module of web/js is as prettier formats it, in 100 columns (web/.prettierrc.json)."""
    done = subprocess.run([installed(FORMATTER, "prettier"), "--check", *modules()], capture_output=True, text=True,
                          timeout=200, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_dashboards_code_keeps_its_rules():
    """No ternary stands directly within another, no assignment within an expression; both are found where they are planted."""
    rules = [shutil.which("node"), os.path.join(program.SOURCE, "tests", "contract", "code_rules.mjs"),
             os.path.join(os.path.dirname(os.path.dirname(installed(FORMATTER, "prettier"))), "prettier")]
    done = subprocess.run([*rules, *modules()], capture_output=True, text=True, timeout=200, check=True)
    assert done.stdout == "", done.stdout
    planted = os.path.join(program.build, "planted.mjs")
    with open(planted, "w", encoding="utf-8") as file:
        file.write("let a = 1;\nexport const b = a ? 1 : a > 2 ? 3 : 4;\nfor (a = 0; a < 2; a = a + 1);\nexport const c = () => (a = 2);\n")
    done = subprocess.run([*rules, planted], capture_output=True, text=True, timeout=200, check=True)
    found = [line.removeprefix(planted) for line in done.stdout.splitlines()]
    assert found == [":2: a ternary within another", ":4: an assignment within an expression"], found


if __name__ == "__main__":
    program.main(globals())
