"""The Python environment that scripts/venv makes, for scripts whose packages the calling Python has not."""
import os
import sys
from pathlib import Path

TOP = Path(__file__).resolve().parent.parent
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "supple"  # of an installed copy, where the user may not write


def start_again(missing):
    """Starts the calling script again with that environment, or ends with what is missing and the cure."""
    script = Path(sys.argv[0])
    for venv in (TOP / ".venv", CACHE / "venv"):
        python = venv / "bin" / "python"
        if python.exists() and Path(sys.prefix).resolve() != venv.resolve():
            os.execv(python, [str(python), os.path.abspath(script)] + sys.argv[1:])
        if python.exists():
            break
    sys.exit(f"scripts/{script.name}: {missing}; run {TOP / 'scripts/venv'}, which makes the Python environment for this")
