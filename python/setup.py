# The version is the program's.
import re
from pathlib import Path

from setuptools import setup

header = Path(__file__).resolve().parent.parent / "include" / "sbbase.h"
setup(version=re.search(r'#define SB_VERSION "([^"]+)"', header.read_text())[1])
