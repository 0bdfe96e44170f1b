"""The documents hold: links and their anchors exist, and so does every document that a source names; the commands of README.md, of the guides and of
docs/reference/ do what they are there for.

A command is a line of an indented block that begins with bin/, scripts/ or .venv/. It is run as it stands, in a folder where the repository seems to be, the scenarios
with the shorter settings below; `scripts/mpi N` becomes the launcher of the tests. A block behind `<!-- file: NAME -->` is written to that file, for the commands behind it. `make TARGET` must
be a target, and in docs/reports/ every command must be there.

@cpu 300
"""
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

TOP = Path(__file__).resolve().parents[2]
OUT = Path(os.environ["SB_OUT"]).resolve()
MPI = os.environ["SB_MPI"]
SUPPLE = (TOP / os.environ["SB_SUPPLE"]).resolve()
# What makes a scenario short; the last value of an option counts.
SHORT = {
    "demo": "-ts_max_time 0.1", "organ": "-ts_max_time 0.02", "finger": "-ts_max_time 0.05", "hanging": "-ts_max_time 0.02 -body_thing_tet_size 0.006", "scan":
    "-body_organ_element p1 -body_organ_tet_size 0.006 -static_steps 1 -effect_tool_displacement '0;0;-0.001*t'", "indent":
    "-body_tissue_mesh box:0.1,0.06,0.04:4 -ts_dt 0.05 -ts_max_time 0.1", "pile": "-ts_max_time 0.09", "fold": "-ts_max_time 0.05", "press": "-ts_max_time 0.1",
    "drop": "-ts_max_time 0.13", "jaws": "-ts_max_time 0.03", "pumped": "-ts_max_time 0.03", "gripped": "-ts_max_time 0.03", "rubber": "-body_block_mesh box:0.06,0.06,0.04:1 -static_steps 1", "relax": "-ts_max_time 0.1",
}

passed = failed = 0


def check(text, good):
    global passed, failed
    passed, failed = passed + bool(good), failed + (not good)
    if not good:
        print(f"failed: {text}")


def anchors(page):
    """The anchors of the headings of a page, as GitHub and MkDocs make them."""
    out = set()
    for head in re.findall(r"^#+ (.*)$", page.read_text(), re.M):
        plain = re.sub(r"[^\w\- ]", "", head.lower())
        out |= {plain.replace(" ", "-"), re.sub(r"[-\s]+", "-", plain).strip("-")}
    return out


def links(pages):
    for page in pages:
        text = re.sub(r"^(    |\t).*$", "", page.read_text(), flags=re.M)
        for target in re.findall(r"\]\(([^)\s]+)\)", text):
            if re.match(r"[a-z]+:", target):
                continue
            path, _, anchor = target.partition("#")
            there = (page.parent / path).resolve() if path else page
            name = f"{page.relative_to(TOP)}: {target}"
            check(f"{name}: no such file", there.exists())
            if anchor and there.exists():
                check(f"{name}: no such heading", anchor in anchors(there))


def sources():
    """What sources, scripts and scenarios say to read, and the programs that scripts/bench runs."""
    files = subprocess.run(["git", "ls-files"], cwd=TOP, capture_output=True, text=True).stdout.split() or [
        str(p.relative_to(TOP)) for folder in ("src", "include", "scripts", "scenarios", "tests") for p in (TOP / folder).rglob("*") if p.is_file()]
    for name in files + ["Makefile"]:
        path = TOP / name
        if not path.is_file() or path.suffix in (".png", ".svg", ".msh", ".csv") or path == Path(__file__).resolve():
            continue
        for page in re.findall(r"\bdocs/[\w/]+\.(?:md|png|csv)\b", path.read_text(errors="replace")):
            check(f"{name}: there is no {page}", (TOP / page).exists() or page.endswith("NAME.png"))
    for name in re.findall(r'bench\.run\(\s*\w+, "(\w+)"', (TOP / "scripts/bench").read_text()):
        check(f"scripts/bench: there is no tests/perf/{name}.c", (TOP / f"tests/perf/{name}.c").exists())


def blocks(page):
    """(name of the file to write or None, lines) of each indented block."""
    name, block, out, last = None, [], [], ""
    for line in page.read_text().split("\n") + [""]:
        mark = re.match(r"<!-- file: (\S+) -->", line)
        if line.startswith("    ") and (block or last == "") or (block and line == ""):
            block.append(line[4:])
        else:
            if block:
                out.append((name, block))
                name = None
            block = []
            name = mark[1] if mark else name if line == "" else None
        last = "" if mark else line
    return out


def commands(lines):
    """Command lines of a block, with their continuations and here-documents."""
    lines, out = list(lines), []
    while lines:
        line = lines.pop(0)
        while line.endswith("\\") and lines:
            line = line[:-1] + lines.pop(0).lstrip()
        here = re.search(r"<<'?(\w+)'?", line)
        while here and lines:
            line += "\n" + lines.pop(0)
            if line.endswith("\n" + here[1]):
                break
        if re.match(r"(bin|scripts|build|\.venv)/|make ", line) and "/path/to" not in line:
            out.append(line)
    return out


def run(page, line):
    """Runs a command of a guide, made short."""
    line = re.sub(r"^scripts/mpi\b", MPI, line)
    if "bin/supple " in line and "-help" not in line:
        scenario = re.search(r"([\w/]+)\.opts\b", line)
        line = re.sub(r"\s+#\s.*$", "", line) + " -output_every 0 -progress no " + SHORT.get(Path(scenario[1]).name if scenario else "", "")
    done = subprocess.run(["bash", "-c", line], cwd=OUT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          env={**os.environ, "PETSC_OPTIONS": ""}, errors="replace")
    last = done.stdout.strip().split("\n")[-1]
    if done.returncode:
        last = next((x for x in done.stdout.split("\n") if "error: " in x), last)
    check(f"{page.name}: {line.splitlines()[0]}: exit code {done.returncode}: {last}", done.returncode == 0)


def main():
    pages = [TOP / "README.md", *sorted((TOP / "docs").rglob("*.md"))]
    links(pages)
    sources()
    style = (TOP / "docs" / "site.css").read_text() if "extra_css: [site.css]" in (TOP / "mkdocs.yml").read_text() else ""
    check("tables of the site hide columns", "white-space: normal" in style)
    for name in ("scripts", "scenarios", "tests", "docs", "meshes", ".venv"):
        if (TOP / name).exists():
            (OUT / name).symlink_to(TOP / name)
    (OUT / "bin").symlink_to(SUPPLE.parent)
    targets = set(re.findall(r"^([a-z-]+):", (TOP / "Makefile").read_text(), re.M))
    nrun = 0
    for page in pages:
        guide = page.parent.name in ("guides", "reference") or page.name == "README.md"
        for name, block in blocks(page):
            if name:
                (OUT / name).write_text("\n".join(block) + "\n")
                continue
            for line in commands(block):
                words = shlex.split(line.split("\n")[0], comments=True)
                if words[0] == "make":
                    for word in words[1:]:
                        check(f"{page.name}: {line}: no such target", "=" in word or word.startswith("-") or word in targets or word.startswith(("meshes/", "build/tests/", "bin/")))
                elif guide and words[0].startswith(("bin/", ".venv/", "scripts/mpi", "scripts/render", "scripts/fit")):
                    run(page, line)
                    nrun += 1
                elif words[0].startswith(("build/", "bin/")):
                    source = words[0].replace("build/", "").replace("tests/hard/hard", "tests/hard/hard.c").removesuffix(".c") + ".c"
                    check(f"{page.name}: {line}: there is no {source}", words[0].startswith("bin/") or (TOP / source).exists())
                else:
                    check(f"{page.name}: there is no {words[0]}", os.access(TOP / words[0], os.X_OK))
    check(f"only {nrun} commands were run", nrun >= 20)
    print(f"{passed} passed, {failed} failed")
    sys.exit(failed > 0)


main()
