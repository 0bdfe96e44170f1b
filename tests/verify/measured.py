"""What others measured or published, on the coarse meshes of scripts/measured."""
import os
import shutil
import subprocess
import sys

if not shutil.which("gmsh"):
    print("gmsh is missing")
    sys.exit(77)
sys.exit(subprocess.run([sys.executable, "scripts/measured", "--check", "--program", os.environ["SB_SUPPLE"]]).returncode)
