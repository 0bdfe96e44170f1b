"""What those who join meet: the top level has the folders that it has; the rows of the hosted verification are commands that run by hand, and name what is wrong with others; hooks
before a commit call what is there; scripts/coverage counts lines, for two small files; no type of the program is among
what the documents say it does not have.

@cpu 60
"""
import csv
import os
import re
import shutil
import subprocess
from pathlib import Path

import yaml

TOP = Path(__file__).resolve().parents[2]
OUT = Path(os.environ["SB_OUT"]).resolve()
# besides hidden files and folders
TOP_LEVEL = {"Makefile", "README.md", "CHANGELOG.md", "CITATION.cff", "LICENSE", "mkdocs.yml", "docs", "include", "meshes", "packaging", "python", "scenarios", "scripts", "src",
             "tests"}

passed = failed = 0


def check(text, good):
    global passed, failed
    passed, failed = passed + bool(good), failed + (not good)
    if not good:
        print(f"failed: {text}")


def run(*words, cwd=TOP, env=None):
    return subprocess.run([str(w) for w in words], cwd=cwd, capture_output=True, text=True, env=os.environ | (env or {}))


def top_level():
    names = run("git", "ls-tree", "--name-only", "HEAD").stdout.split()
    more = [name for name in names if name not in TOP_LEVEL and not name.startswith(".")]
    check(f"new at the top level: {more}", not more)


def rows():
    """Each row is .ci/run or .ci/row with words that it takes; one that it does not take is an error before anything is installed."""
    text = yaml.safe_load((TOP / ".github/workflows/ci.yml").read_text())
    commands = [row["run"].split() for row in text["jobs"]["row"]["strategy"]["matrix"]["include"]]
    check("the hosted verification has no .ci/run", [".ci/run"] in commands)
    targets = set(re.findall(r"^([a-z-]+):", (TOP / "Makefile").read_text(), re.M))
    for words in commands:
        check(f"{words[0]} is no program", os.access(TOP / words[0], os.X_OK))
        if words[0] == ".ci/row":
            known = words[1] in ("gcc", "clang") and words[2] in ("openmpi", "mpich") and words[3] in ("system", "newest", "newest64") and words[2:4] != ["mpich", "system"]
            check(f"{' '.join(words)} is no row", known and (len(words) < 5 or words[4] in targets))
    for words, what in (((), "usage"), (("icc", "openmpi", "system"), "icc"), (("gcc", "lam", "newest"), "lam"), (("gcc", "openmpi", "old"), "old"), (("gcc", "mpich", "system"), "mpich")):
        done = run(".ci/row", *words)
        check(f".ci/row {words}: {done.stderr}", done.returncode == 2 and what in done.stderr)
    done = run(".ci/petsc", OUT / "petsc", "openmpi", "16")
    check(f".ci/petsc with 16 bits: {done.stderr}", done.returncode == 2 and "16" in done.stderr and not (OUT / "petsc").exists())
    done = run("scripts/install-deps", "run", env={"MPI_PACKAGES": "lam"})
    check(f"scripts/install-deps for another MPI: {done.stderr}", done.returncode == 2 and "lam" in done.stderr)


def hooks():
    for hook in yaml.safe_load((TOP / ".pre-commit-config.yaml").read_text())["repos"][0]["hooks"]:
        program, *words = hook["entry"].split()
        check(f"hook {hook['id']}: there is no {program}", os.access(TOP / program, os.X_OK))
        check(f"hook {hook['id']}: {words}", program != "scripts/lint" or all(re.search(rf"^    {word}\) ", (TOP / program).read_text(), re.M) for word in words))
    done = run("scripts/lint", "taste")
    check(f"scripts/lint taste: {done.stderr}", done.returncode == 2 and "taste" in done.stderr)


def coverage():
    """One of two branches is run: a file of which nobody runs anything counts, too."""
    if not shutil.which("gcov"):
        return
    build = OUT / "build/src"
    build.mkdir(parents=True)
    (OUT / "src").mkdir()
    (OUT / "src/half.c").write_text("int half(int n)\n{\n  if (n > 2)\n    return n / 2;\n  return 0;\n}\nint main(void)\n{\n  return half(1);\n}\n")
    (OUT / "src/none.c").write_text("int none(void)\n{\n  return 1;\n}\n")
    for name in ("half", "none"):
        run("gcc", "-O0", "--coverage", "-c", f"src/{name}.c", "-o", build / f"{name}.o", cwd=OUT)
    run("gcc", "--coverage", build / "half.o", "-o", OUT / "half", cwd=OUT)
    check("the small program", run(OUT / "half", cwd=OUT).returncode == 0)
    done = run("scripts/coverage", OUT / "build")
    found = [(name, float(share)) for share, name in re.findall(r"^ *([\d.]+)% +\d+  (src/\S+)", done.stdout, re.M)]
    check(f"scripts/coverage: {done.stdout} {done.stderr}", [name for name, _ in found] == ["src/none.c", "src/half.c"] and found[0][1] == 0 and 60 < found[1][1] < 100)
    done = run("scripts/coverage", OUT / "src")
    check(f"scripts/coverage without counters: {done.stderr}", done.returncode == 1 and "make coverage" in done.stderr)


def missing():
    """What docs/reference/not_there.md says is not there is no type of the program: the beginnings of its rows beside the names of effects and materials."""
    page = (TOP / "docs/reference/not_there.md").read_text()
    pieces = [piece.strip().lower() for row in re.findall(r"^\| ([^|`]+) \|", page, re.M) for piece in re.split(r"[,:;]| and ", row)]
    table = csv.DictReader(run(TOP / os.environ["SB_SUPPLE"], "-options_table").stdout.splitlines(), delimiter="\t", quoting=csv.QUOTE_NONE)
    types = {row["type"] for row in table if row["class"] in ("effect", "body") and len(row["type"]) > 2}
    check(f"{len(types)} types, {len(pieces)} things that are not there", len(types) > 20 and len(pieces) > 40)
    for name in sorted(types):
        found = [piece for piece in pieces if piece.startswith(name.replace("_", " ").removesuffix("y"))]
        check(f"docs/reference/not_there.md says there is no {found}: {name} is a type", not found)


top_level()
rows()
hooks()
coverage()
missing()
print(f"{passed} passed, {failed} failed")
raise SystemExit(failed > 0)
