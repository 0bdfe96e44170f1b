# Copyright Spack Project Developers. See COPYRIGHT file for details.
#
# SPDX-License-Identifier: (Apache-2.0 OR MIT)

from spack_repo.builtin.build_systems.makefile import MakefilePackage

from spack.package import *


class Supple(MakefilePackage):
    """Soft bodies (organs, rubber, gels) by finite elements on tetrahedra, in
    parallel, on PETSc: near incompressibility, contact with friction, large
    deformations, error estimates."""

    homepage = "https://example.org/supple"
    url = "https://example.org/supple/releases/supple-0.1.0.tar.gz"
    git = "https://example.org/supple.git"

    license("BSD-2-Clause")

    version("main", branch="main")

    variant("gmsh", default=True, description="Surfaces are filled with tetrahedra by gmsh")

    depends_on("c", type="build")
    depends_on("gmake", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("python@3.7:", type="build")

    depends_on("mpi")
    depends_on("petsc@3.18:3.18,3.25:+mpi+hdf5+metis+double~complex")
    depends_on("petsc+suite-sparse")
    depends_on("hdf5+mpi")
    depends_on("metis@5:")
    depends_on("zlib-api")
    depends_on("gmsh", type=("build", "run"), when="+gmsh")

    @property
    def settings(self):
        """Settings of the Makefile; PETSC_DIR is set by the package of PETSc."""
        return [
            f"CC={self.spec['mpi'].mpicc}",
            f"PREFIX={self.prefix}",
            "PETSC_ARCH=",
            "OPT=-O3 -fno-math-errno -fno-trapping-math",
        ]

    def build(self, spec, prefix):
        make(*self.settings)

    def install(self, spec, prefix):
        make("install", *self.settings)

    @run_after("install")
    @on_package_attributes(run_tests=True)
    def check_install(self):
        supple = Executable(self.prefix.bin.supple)
        supple(join_path(self.prefix.share.supple, "scenarios", "cantilever.opts"))
