"""Damaged inputs of a run, thousands of ways: states, checkpoints, tables, files of copies, option files, live input.

Each input is a good one with bytes changed, lost, doubled, or numbers replaced, by a generator with a fixed seed. The program must run,
or end with one line of error: no signal, no trace, no wait. SB_MUTATIONS: inputs of each kind (make sanitize and make check-long: more).

@cpu 200
"""
import os
import random
import re
import resource
import shutil
import subprocess
import sys
from pathlib import Path

OUT = Path(os.environ["SB_OUT"])
COUNT = int(os.environ.get("SB_MUTATIONS", "25"))
SUPPLE = os.environ["SB_SUPPLE"]
BLOCK = ("-bodies block -body_block_mesh box:0.1,0.1,0.1:1 -body_block_material linear -body_block_young 1e5 -body_block_poisson 0.3 "
         "-body_block_density 1000 -effects gravity -ts_dt 0.01 -output_overwrite -quiet").split()
WORDS = [b"nan", b"inf", b"-1", b"1e400", b"99999999999", b"0", b"", b"1e-320", b"0x1p5", b"table:x", b"/dev/zero", b"\x00", b"\xff", b"#", b";", b"\n", b"-"]
os.environ["ASAN_OPTIONS"] = "detect_leaks=0:allocator_may_return_null=1"  # a length that is nonsense is an error, no crash
failed: list[str] = []
runs = refused = 0


def mutate(data: bytes, choose: random.Random) -> bytes:
    """A good input with one to four faults."""
    for _ in range(choose.randrange(1, 5)):
        way, n = choose.randrange(7), max(len(data), 1)
        at, size = choose.randrange(n), choose.choice((1, 1, 2, 4, 8, 64, 512))
        if way == 0:
            data = data[:at] + bytes([choose.randrange(256)]) + data[at + 1:]
        elif way == 1:
            data = data[:at] + bytes(choose.randrange(256) for _ in range(size)) + data[at + size:]
        elif way == 2:
            data = data[:at] + data[at + size:]
        elif way == 3:
            data = data[:at] + data[at:at + size] * 2 + data[at + size:]
        elif way == 4:
            data = data[:at]
        elif way == 5:
            data = data[:at] + bytes([data[at] ^ 1 << choose.randrange(8)]) + data[at + 1:] if data else data
        else:
            found = list(re.finditer(rb"[-+.0-9eE]+", data[:4000]))
            if found:
                one = choose.choice(found)
                data = data[:one.start()] + choose.choice(WORDS) + data[one.end():]
    return data


def curb() -> None:
    """A run that never ends, or takes all memory, is one that fails."""
    resource.setrlimit(resource.RLIMIT_CPU, (60, 60))
    resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 28, 1 << 28))


def look(kind: str, i: int, options: list[str], file: Path) -> None:
    """Runs, and keeps the file if it ends neither well nor with one line."""
    global runs, refused
    try:
        done = subprocess.run([SUPPLE, *BLOCK, *options], capture_output=True, text=True, errors="replace", check=False, preexec_fn=curb, timeout=600)
        lines = [line for line in done.stderr.splitlines() if line.startswith("supple: error:")]
        code, text = done.returncode, done.stdout + done.stderr
    except subprocess.TimeoutExpired:
        code, lines, text = -1, [], "no end"
    runs, refused = runs + 1, refused + (code == 1)
    good = code == 0 and not lines or code in (1, 2, 3) and len(lines) == 1 and len(lines[0]) > 20
    if good and not re.search(r"PETSC ERROR|Sanitizer|runtime error|HDF5-DIAG", text):
        return
    kept = OUT / f"broken_{kind}_{i}"
    shutil.copy(file, kept)
    failed.append(f"{kind} {i}: exit code {code}, {kept}, {' '.join(options)}: {text[-500:]}")


def good(name: str, *options: str) -> Path:
    """A run that ends well."""
    done = subprocess.run([SUPPLE, *BLOCK, *options, "-output_dir", str(OUT / name)], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(done.stdout + done.stderr)
    return OUT / name


first = good("good", "-ts_max_time", "0.02", "-checkpoint_every_steps", "1", "-output_fields", "displacement,velocity")
state = (first / "fields.h5").read_bytes()
checkpoints = sorted(p for p in first.rglob("*") if p.is_file() and "checkpoint" in str(p))
kinds = (sys.argv[1:] or ["state", "checkpoint", "table", "copies", "options"])
for kind in kinds:
    choose = random.Random(kind)
    for i in range(COUNT):
        if kind == "state":
            file = OUT / "state.h5"
            file.write_bytes(mutate(state, choose))
            options = ["-body_block_state", str(file), "-ts_max_time", "0.01", "-output_dir", str(OUT / "run")]
        elif kind == "checkpoint":
            shutil.rmtree(OUT / "again", ignore_errors=True)
            shutil.copytree(first, OUT / "again")
            file = OUT / "again" / choose.choice(checkpoints).relative_to(first)
            file.write_bytes(mutate(file.read_bytes(), choose))
            options = ["-restart", "latest", "-ts_max_time", "0.03", "-output_dir", str(OUT / "again")]
        elif kind == "table":
            file = OUT / "table.txt"
            file.write_bytes(mutate(b"# time value\n0 1\n0.005, 2 # here\n0.01\t0.5\n1;-3e0\n", choose))
            options = ["-effect_gravity_time", f"table:{file}", "-ts_max_time", "0.01", "-output_dir", str(OUT / "run")]
        elif kind == "copies":
            file = OUT / "copies.txt"
            file.write_bytes(mutate(b"# x y z axis degrees scale v\n0 0 0\n1 0 0 0 0 1 30\n2 0 0 0 1 1 45 2 0 0 1\n", choose))
            options = ["-body_block_copies", str(file), "-ts_max_time", "0.01", "-output_dir", str(OUT / "run")]
        else:
            file = OUT / "more.opts"
            file.write_bytes(mutate(b"# more\n-effects gravity,floor\n-effect_floor_type contact\n-effect_floor_obstacle plane:0,0,1,-0.1\n-body_block_velocity"
                                    b" 0;0;0.1*sin(t)\n-probes p\n-probe_p_at 0,0,0.1\n-output_every 0.01\n", choose))
            options = ["-options_file", str(file), "-ts_max_time", "0.01", "-output_dir", str(OUT / "run")]
        look(kind, i, options, file)

for text in failed[:10]:
    print("FAILED:", text)
print(f"{runs} inputs, {refused} of them refused, {len(failed)} failed")
sys.exit(len(failed) > 0 or not refused)
