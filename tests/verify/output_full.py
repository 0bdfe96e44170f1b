"""A disk that fills up ends a run with one line that names the file and its bytes, and costs nothing that was complete.

A full disk is played by a limit on the size of files, set while the run is going on. Also: a folder that cannot be
written, which must be found before anything is computed.
"""
import json
import re
import resource
import shutil
import socket
import subprocess
import sys
import time

from output_common import MPI, OUT, SUPPLE, check_frames, command, history, run, scenario
from output_kill import ranks_of


def fill_up(ranks, folder, frames, *more):
    """Starts a long run, lets it write a few frames, then lets no file grow. Returns exit code and output."""
    shutil.rmtree(OUT / folder, ignore_errors=True)
    args = command(ranks, folder, "-ts_max_time", "100", "-progress", "false", *more)
    process = subprocess.Popen(args, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    index = OUT / folder / "fields.xmf"
    while not (index.exists() and index.read_text().count("<Time") >= frames) and process.poll() is None:
        time.sleep(0.01)
    for pid in ranks_of(process.pid):
        resource.prlimit(pid, resource.RLIMIT_FSIZE, (60000, 60000))
    text, _ = process.communicate()  # an end that does not come is found by tests/run
    return process.returncode, text


def check_full(ranks, folder, file, frames, *more):
    code, text = fill_up(ranks, folder, frames, *more)
    if code == 0:
        sys.exit(f"{folder}: exit code 0 although the disk was full")
    said = re.findall(r"^.*error: cannot write (\d+) bytes to (\S+): (.+)$", text, re.M)
    if len(said) != 1 or not said[0][1].endswith(file) or int(said[0][0]) <= 0:
        sys.exit(f"{folder}: no single line on {file}\n{text}")
    n = check_frames(folder)
    names, rows = history(folder)
    if n < frames or len(rows) < n - 1 or any(len(row) != len(names) for row in rows):
        sys.exit(f"{folder}: {n} frames, {len(rows)} rows of {len(names)} columns")
    told = json.loads((OUT / folder / "run.json").read_text())
    if told["status"] != "failed" or file not in told["reason"]:
        sys.exit(f"{folder}: run.json says {told['status']}: {told['reason']}")
    print(f"{folder}: {said[0]}; {n} frames are readable")


def check_unwritable():
    """A file where the folder should be; this fails for root, too."""
    (OUT / "file").write_text("")
    for ranks in (1, 2):
        text = run(ranks, "file/results", fails=True)
        if not re.search(r"error: -output_dir \S+file/results cannot be written: Not a directory", text):
            sys.exit(f"no line on a folder that cannot be made\n{text}")
        if "tets" in text:
            sys.exit("the bodies were read before the folder was tried")


def check_default_folder():
    """Without -output_dir: out/<scenario>; the results of a first run are moved aside by a second and replaced by a third, other files stay."""
    path = scenario().resolve()
    shutil.rmtree(OUT / "out", ignore_errors=True)
    args = [*MPI, "1", SUPPLE, str(path), "-ts_max_time", "0.01"]
    for kept, more in ((0, []), (1, []), (1, ["-output_overwrite", "yes"]), (2, [])):
        text = subprocess.run([*args, *more], cwd=OUT, capture_output=True, text=True, check=True).stdout
        aside = sorted((OUT / "out" / "bar").glob("before_*"))
        if len(aside) != kept or ("results of an earlier run are kept" in text) != (kept > 0 and not more):
            sys.exit(f"{aside}: {text}")
        for folder in aside:
            if json.loads((folder / "run.json").read_text())["status"] != "completed" or not (folder / "fields.h5").exists():
                sys.exit(f"{folder} is not the result of a run")
        (OUT / "out" / "bar" / "notes.txt").write_text("mine")
    told = json.loads((OUT / "out" / "bar" / "run.json").read_text())
    if told["status"] != "completed" or told["steps"] != 1 or "fields.h5" not in [f["name"] for f in told["files"]]:
        sys.exit(f"run.json of a run that ended well: {told}")
    if not (OUT / "out" / "bar" / "notes.txt").exists() or not (OUT / "out" / "bar" / "fields.xmf").exists():
        sys.exit("a file that is not ours is gone")


def check_lock():
    """A second run into a folder in use is refused with the first one's process; when that is gone, even by a kill, it is not."""
    shutil.rmtree(OUT / "lock", ignore_errors=True)
    process = subprocess.Popen(command(1, "lock", "-ts_max_time", "1000", "-quiet"), stdout=subprocess.DEVNULL)
    while not (OUT / "lock" / "history.csv").exists() and process.poll() is None:
        time.sleep(0.02)
    text = run(2, "lock", "-ts_max_time", "0.01", fails=True)
    if f"lock is in use by another run, process {process.pid} on {socket.gethostname()} since 20" not in text:
        sys.exit(f"the folder of a run that goes on: {text}")
    process.kill()
    process.wait()
    run(2, "lock", "-ts_max_time", "0.01")
    if list((OUT / "lock").glob(".supple*")):
        sys.exit("a lock is left behind")


def main():
    scenario()
    check_lock()
    for ranks in (1, 2):
        check_full(ranks, f"fields{ranks}", "fields.h5", 4)
        check_full(ranks, f"history{ranks}", "history.csv", 1, "-output_every", "1000")
    check_unwritable()
    check_default_folder()


if __name__ == "__main__":
    main()
