"""How a user gets supple: `make install` into an empty folder, its man pages and completions; docs/options.md as the table of options has it; one version
everywhere; a release made in a clone.

@cpu 120
"""
import csv
import os
import re
import shutil
import subprocess
from pathlib import Path

TOP = Path(__file__).resolve().parents[2]
OUT = Path(os.environ["SB_OUT"]).resolve()
SUPPLE = (TOP / os.environ["SB_SUPPLE"]).resolve()
# a make within make must not take the outer one's settings
ENV = {k: v for k, v in os.environ.items() if k not in ("MAKEFLAGS", "MAKELEVEL", "MFLAGS")}

passed = failed = 0


def check(text, good):
    global passed, failed
    passed, failed = passed + bool(good), failed + (not good)
    if not good:
        print(f"failed: {text}")


def run(*words, cwd=TOP, text=None, env=ENV):
    return subprocess.run([str(w) for w in words], cwd=cwd, input=text, capture_output=True, text=True, env=env)


def rows():
    text = run(SUPPLE, "-options_table").stdout
    return list(csv.DictReader(text.splitlines(), delimiter="\t", quoting=csv.QUOTE_NONE))


def install():
    """Programs run where they were installed, from another folder; nothing lies outside of PREFIX."""
    done = run("make", "-s", "--assume-old=bin/supple", "--assume-old=bin/supple-mesh", "install", f"DESTDIR={OUT}/root", "PREFIX=/opt/supple",
               f"BUILD={OUT}/build", "MESHES=")
    check(f"make install: {done.stderr[-400:]}", done.returncode == 0)
    root = OUT / "root/opt/supple"
    check(f"outside of PREFIX: {os.listdir(OUT / 'root')}", os.listdir(OUT / "root") == ["opt"] and os.listdir(OUT / "root/opt") == ["supple"])
    for name in ("bin/supple", "bin/supple-mesh", "share/man/man1/supple.1", "share/man/man1/supple-mesh.1", "share/bash-completion/completions/supple",
                 "share/bash-completion/completions/supple-mesh", "share/zsh/site-functions/_supple", "share/supple/scenarios/cantilever.opts", "share/doc/supple/CITATION.cff"):
        check(f"not installed: {name}", (root / name).is_file())
    done = run(root / "bin/supple", root / "share/supple/scenarios/cantilever.opts", "-progress", "no", cwd=OUT)
    check(f"the installed program: {done.stderr}", done.returncode == 0 and (OUT / "out/cantilever/history.csv").is_file())
    done = run("make", "-s", "check-installed", f"DESTDIR={OUT}/root", "PREFIX=/opt/supple")
    check(f"make check-installed: {done.stdout[-400:]} {done.stderr[-400:]}", done.returncode == 0 and str(root / "bin") in done.stdout)
    done = run("make", "-s", "check-installed", f"PREFIX={OUT}/nowhere")
    check("make check-installed without an installation", done.returncode != 0)
    # the Python environment of a copy that the user may not write to is in the user's cache
    cache = OUT / "cache/supple"
    cache.mkdir(parents=True)
    (cache / "venv").symlink_to(TOP / ".venv")
    done = run("/usr/bin/env", f"XDG_CACHE_HOME={OUT}/cache", "python3", "-S", root / "share/supple/scripts/plot", OUT / "out/cantilever", "-o", OUT / "plot.png", cwd=OUT)
    check(f"scripts/plot of the installed copy: {done.stderr[-400:]}", done.returncode == 0 and (OUT / "plot.png").is_file())
    return root


def man(root, table):
    text = (root / "share/man/man1/supple.1").read_text().replace("\\-", "-")
    for row in table:
        check(f"supple.1 has no {row['option']}", f"\\fB{row['option']}\\fR" in text)
    pages = [root / f"share/man/man1/{name}.1" for name in ("supple", "supple-mesh")]
    for page in pages:
        if shutil.which("groff"):
            done = run("groff", "-man", "-Tutf8", "-ww", "-z", page)
            check(f"{page.name}: {done.stderr[:400]}", done.returncode == 0 and not done.stderr)
        if shutil.which("mandoc"):
            done = run("mandoc", "-Tlint", "-Wwarning", page)
            check(f"{page.name}: {done.stdout[:400]}", not done.stdout)


def complete(root, *words):
    """What bash offers for the last of the words, one per line."""
    program = words[0].replace("-", "_")
    script = f'. "{root}/share/bash-completion/completions/{words[0]}"; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _{program}; printf "%s\\n" "${{COMPREPLY[@]}}"'
    return run("bash", "-c", script, "bash", *words, cwd=OUT).stdout.split()


def completion(root):
    (OUT / "two.opts").write_text("-bodies liver,skin  # two\n-body_liver_inclusions vein,knot\n-effects floor\n")
    (OUT / "two.yml").write_text("bodies: liver, 'gut'\n")
    (OUT / "notes.txt").write_text("")
    cases = [
        (("supple", "tw"), {"two.opts", "two.yml"}, {"two.txt"}),
        (("supple", ""), {"two.opts", "out/"}, {"notes.txt"}),
        (("supple", "two.opts", "-ts_"), {"-ts_dt", "-ts_max_time"}, {"-time"}),
        (("supple", "two.opts", "-"), {"-body_", "-effect_", "-bodies"}, {"-body_liver_young"}),
        (("supple", "two.opts", "-body_"), {"-body_liver_young", "-body_skin_mesh"}, {"-body_two_young", "-effect_floor_on", "-body_floor_young"}),
        (("supple", "two.yml", "-body_"), {"-body_gut_young", "-body_liver_young"}, {"-body_skin_young"}),
        (("supple", "two.opts", "-bodies", "cap", "-body_cap_y"), {"-body_cap_young"}, {"-body_cap_mesh"}),
        (("supple", "two.opts", "-body_default_y"), {"-body_default_young"}, set()),
        (("supple", "two.opts", "-probe_"), set(), {"-probe__at"}),
        (("supple", "two.opts", "-body_liver_state", "o"), {"out/"}, {"out"}),
        (("supple", "two.opts", "-inclusion_"), {"-inclusion_vein_young", "-inclusion_knot_young"}, {"-inclusion_liver_young"}),
        (("supple", "two.opts", "-effect_floor_"), {"-effect_floor_type", "-effect_floor_friction"}, set()),
        (("supple", "two.opts", "-time", "n"), {"newmark"}, {"genalpha"}),
        (("supple", "two.opts", "-body_liver_material", "st"), {"stvk"}, {"linear"}),
        (("supple", "two.opts", "-validate", ""), {"true", "false"}, {"two.opts"}),
        (("supple", "-help", "con"), {"contact"}, {"body"}),
        (("supple-mesh", ""), {"info", "tet", "convert"}, {"two.opts"}),
        (("supple-mesh", "tet", "organ.stl", "-"), {"-size", "-surface"}, {"-levels"}),
        (("supple-mesh", "refine", "organ.msh", "-"), {"-levels"}, {"-size"}),
        (("supple-mesh", "tet", "organ.stl", "-surface", ""), {"auto", "keep", "remesh"}, set()),
        (("supple-mesh", "info", "tw"), {"two.opts"}, {"notes.txt"}),
    ]
    for words, there, absent in cases:
        offered = complete(root, *words)
        check(f"{' '.join(words)}<TAB> lacks {there - set(offered)} in {offered[:20]}", there <= set(offered))
        check(f"{' '.join(words)}<TAB> offers {absent & set(offered)}", not absent & set(offered))
    if shutil.which("zsh"):
        done = run("zsh", "-fc", f'fpath=({root}/share/zsh/site-functions $fpath); autoload -Uz compinit; compinit -D; print $_comps[supple] $_comps[supple-mesh]', cwd=OUT)
        check(f"zsh: {done.stdout} {done.stderr}", done.stdout.split() == ["_supple", "_supple"])


def documents():
    """docs/options.md is what the table says today."""
    done = run("scripts/manual", "markdown", "--bin", SUPPLE.parent, "-o", OUT / "markdown")
    same = done.returncode == 0 and (OUT / "markdown/options.md").read_text() == (TOP / "docs/options.md").read_text()
    check(f"docs/options.md is not what the table of options says: scripts/manual markdown {done.stderr}", same)


def versions(top):
    """Version of the program, and that of the newest section of the changelog, of the citation and of the recipes."""
    version = re.search(r'^#define SB_VERSION "(.*)"', (top / "include/sbbase.h").read_text(), re.M)[1]
    heads = re.findall(r"^## (\S+)(?: - (\S+))?$", (top / "CHANGELOG.md").read_text(), re.M)
    check(f"CHANGELOG.md begins with {heads[:1]}, the program is {version}", heads[0][0] == version)
    check("CITATION.cff has another version", f"\nversion: {version}\n" in (top / "CITATION.cff").read_text())
    package = re.search(r'^version = "(.*)"', (top / "python/pyproject.toml").read_text(), re.M)[1]
    check(f"python/pyproject.toml is of {package}", package == version)
    recipe = re.search(r'^  version: "(.*)"', (top / "packaging/conda/recipe.yaml").read_text(), re.M)[1]
    check(f"the recipe of conda is for {recipe}", recipe == version or (recipe, ) in [h[:1] for h in heads if h[1]])
    return version


def release():
    """In a clone: the release is tagged and packed, and the tree goes on as the next version; what must not be released is refused."""
    clone = OUT / "clone"
    if run("git", "clone", "-q", TOP, clone).returncode:
        return  # not a checkout
    env = {**ENV, "GIT_AUTHOR_NAME": "a", "GIT_AUTHOR_EMAIL": "a@example.org", "GIT_COMMITTER_NAME": "a", "GIT_COMMITTER_EMAIL": "a@example.org"}

    def refused(what, *words):
        done = run("scripts/release", *words, cwd=clone, env=env)
        check(f"released with {what}: {done.stdout}", done.returncode != 0 and "scripts/release:" in done.stderr)

    refused("a version that is lower", "0.0.9")
    refused("a version that is none", "two")
    (clone / "README.md").write_text("changed\n")
    refused("changes that are not committed", "9.0.0")
    run("git", "checkout", "-q", "README.md", cwd=clone)
    version = versions(clone)
    done = run("scripts/release", "9.0.0", "--home", "https://example.org/moved/", "--date", "2031-02-03", cwd=clone, env=env)
    check(f"scripts/release: {done.stderr}", done.returncode == 0)
    tagged = run("git", "show", f"v{version}:CHANGELOG.md", cwd=clone).stdout
    check("the tag has no dated section", f"\n## {version} - 2031-02-03\n" in tagged)
    check("the tag's text is not the changelog", "one option file" in run("git", "tag", "-n99", "-l", f"v{version}", cwd=clone).stdout or len(run("git", "tag", "-n99", "-l", f"v{version}", cwd=clone).stdout) > 500)
    check("the tree does not go on", versions(clone) == "9.0.0")
    recipe = (clone / "packaging/conda/recipe.yaml").read_text()
    archive = clone / f"build/supple-{version}.tar.gz"
    sha = run("sha256sum", archive).stdout.split()[0]
    check("checksum in the recipes", sha in recipe and sha in (clone / "packaging/spack_repo/supple/packages/supple/package.py").read_text())
    check("address in the citation", "\nrepository-code: https://example.org/moved\n" in (clone / "CITATION.cff").read_text())
    check("address in the recipe", "https://example.org/moved/releases/supple-${{ version }}.tar.gz" in recipe)
    run("git", "checkout", "-q", f"v{version}", cwd=clone)
    again = run("scripts/package", "dist", cwd=clone)
    check(f"the archive is not the same when it is made again: {again.stderr}", again.stdout.split()[:1] == [sha])
    names = run("tar", "tzf", archive).stdout.split()
    check("the archive lacks files", {f"supple-{version}/{n}" for n in ("Makefile", "include/sbbase.h", "scripts/manual", "CITATION.cff")} <= set(names))
    refused("a tag that is there", "9.0.0")


table = rows()
check(f"{len(table)} options in the table", len(table) > 140 and all(r["meaning"] and r["kind"] for r in table))
where = install()
man(where, table)
completion(where)
documents()
versions(TOP)
release()
print(f"{passed} passed, {failed} failed")
raise SystemExit(failed > 0)
