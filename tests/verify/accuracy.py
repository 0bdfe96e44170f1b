"""The chart of what accuracy costs, quick (scripts/accuracy): every run ends well, errors fall at their orders, each problem has its front.

@long
@cpu 900
"""
import os
import subprocess
import sys
from pathlib import Path

TOP = Path(__file__).resolve().parents[2]
OUT = Path(os.environ["SB_OUT"])

done = subprocess.run([sys.executable, str(TOP / "scripts/accuracy"), "--build", str(OUT), "--quick", "--docs", str(OUT / "docs")])
made = {p.name for p in (OUT / "docs").glob("*")}
missing = {"accuracy.md", "accuracy.csv", "accuracy_bar_seconds.svg", "accuracy_drop_seconds.svg"} - made
if not done.returncode and missing:
    sys.exit(f"not written: {', '.join(sorted(missing))}")
sys.exit(done.returncode)
